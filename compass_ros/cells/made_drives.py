"""Made fields of actuators, by what MuJoCo reads: force = gain x (command or activation) + bias.

| gain | numbers that are forces | bias in proportion to them |
|---|---|---|
| fixed | gainprm[0] | affine: biasprm[1] of a servo of positions, else biasprm[2] of one of speeds |
| affine (a damper) | gainprm[0..2] | the same |
| muscle | gainprm[2], or gainprm[3] where the peak force follows from the mass that it moves | muscle: the same place |
| DC motor, user | none: motor constant and resistance are fields of their own | |

A gripper with one command for a range of 0 to 255 has a gain that is not minus its bias: the two scale together.
"""

from __future__ import annotations

from collections.abc import Callable

import mujoco

from compass_ros.errors import ConfigError
from compass_ros.types import Floats

Writer = Callable[[mujoco.MjModel, Floats], None]
"""Writes (P,) values into a model."""
_GAIN, _BIAS = mujoco.mjtGain, mujoco.mjtBias
_PEAK, _SCALE = 2, 3
"""Where a muscle has its peak force, and what it follows from where that is negative."""


def forces(scene: mujoco.MjModel, actuator: int) -> list[int]:
    """Places in gainprm of what an actuator's force is in proportion to, the leading one first; empty: none."""
    kind, gain = int(scene.actuator_gaintype[actuator]), scene.actuator_gainprm[actuator]
    if kind == _GAIN.mjGAIN_MUSCLE:
        return [_PEAK if gain[_PEAK] >= 0 else _SCALE]
    size = {int(_GAIN.mjGAIN_FIXED): 1, int(_GAIN.mjGAIN_AFFINE): 3}.get(kind, 0)
    return sorted(range(size), key=lambda i: gain[i] == 0)


def scales_command(scene: mujoco.MjModel, actuator: int) -> bool:
    """Whether a share of the gain is a share of the command; a muscle's is a share of its activation."""
    return bool(forces(scene, actuator)) and scene.actuator_gaintype[actuator] != _GAIN.mjGAIN_MUSCLE


def stiffness_of(scene: mujoco.MjModel, actuator: int) -> list[int]:
    """Places in biasprm of what grows with the gain: a servo's stiffness, or its damping where it has none."""
    kind, bias = int(scene.actuator_biastype[actuator]), scene.actuator_biasprm[actuator]
    if kind == _BIAS.mjBIAS_MUSCLE:
        return forces(scene, actuator)
    return [1 if bias[1] else 2] if kind == _BIAS.mjBIAS_AFFINE else []


def strength(scene: mujoco.MjModel, actuator: int, column: int, where: str) -> Writer:
    """Writes the leading number of a gain, and all that is in proportion to it. Raises ConfigError."""
    places = _checked(scene, actuator, bool(forces(scene, actuator)), where)
    lead = float(scene.actuator_gainprm[actuator, places[0]])
    parts = [
        (array, at, getattr(scene, array)[actuator, at].copy())
        for array, at in (("actuator_gainprm", places), ("actuator_biasprm", stiffness_of(scene, actuator)))
    ]

    def write(model: mujoco.MjModel, values: Floats) -> None:
        value = values[column]
        for array, at, nominal in parts:  # at the scene's own value the scene's own numbers, to the last bit
            getattr(model, array)[actuator, at] = value * (nominal / lead) if lead and value != lead else nominal
        model.actuator_gainprm[actuator, places[0]] = value

    return write


def whole_command(scene: mujoco.MjModel, actuator: int, where: str) -> Writer:
    """Puts the scene's gain back, before others write it and `command` takes a share. Raises ConfigError."""
    places = _checked(scene, actuator, scales_command(scene, actuator), where)
    nominal = scene.actuator_gainprm[actuator, places].copy()

    def write(model: mujoco.MjModel, values: Floats) -> None:
        model.actuator_gainprm[actuator, places] = nominal

    return write


def command(scene: mujoco.MjModel, actuator: int, column: int) -> Writer:
    """Multiplies the gain, as it has been written by then, by the share of the command that arrives."""
    places = forces(scene, actuator)

    def write(model: mujoco.MjModel, values: Floats) -> None:
        model.actuator_gainprm[actuator, places] *= values[column]

    return write


def _checked(scene: mujoco.MjModel, actuator: int, has: bool, where: str) -> list[int]:
    """Places of the forces. Raises ConfigError where the actuator does not have what is asked for."""
    if not has:
        kind = _GAIN(int(scene.actuator_gaintype[actuator])).name.removeprefix("mjGAIN_").lower()
        raise ConfigError(f"{where}: actuator '{scene.actuator(actuator).name}' has none; its gain is '{kind}'")
    return forces(scene, actuator)

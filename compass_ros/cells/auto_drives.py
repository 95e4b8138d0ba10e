"""Which fields of actuators and tendons can be tuned, and how far each may be from what the scene says.

What an actuator's numbers mean follows from the kinds of its gain, its bias, its dynamics and its transmission; those
that MuJoCo does not read are left out.
"""

from __future__ import annotations

from collections.abc import Iterator

import mujoco

from compass_ros.cells.candidate import Candidate, around, from_zero, times
from compass_ros.cells.made_drives import forces, scales_command, stiffness_of

_GAIN, _BIAS, _DYN, _TRN = mujoco.mjtGain, mujoco.mjtBias, mujoco.mjtDyn, mujoco.mjtTrn
_LAGS = {
    int(_DYN.mjDYN_FILTER): ("time_constant",),
    int(_DYN.mjDYN_FILTEREXACT): ("time_constant",),
    int(_DYN.mjDYN_MUSCLE): ("activation_time", "deactivation_time"),
}
"""Leading numbers of dynprm, of the dynamics that have times in them [s]."""
_JOINT = (int(_TRN.mjTRN_JOINT), int(_TRN.mjTRN_JOINTINPARENT))


def actuator_fields(m: mujoco.MjModel, actuator: int) -> Iterator[Candidate]:
    """Strength, command, offset, lag, gear, what the drive adds in damping and inertia, and its limits."""
    name = m.actuator(actuator).name
    yield from _force(m, actuator, f"{name}@actuation@")
    for i, what in enumerate(_LAGS.get(int(m.actuator_dyntype[actuator]), ())):
        lag = float(m.actuator_dynprm[actuator, i])
        yield times(f"{name}@actuation@{what}", f"actuator_dynprm[{i}]", name, lag, 0.8, 0.2, "s")
    yield from _gear(m, actuator, f"{name}@actuation@gear")
    inertia = _inertia(m, actuator)
    for what, share, unit in (("damping", 0.05, "N s/m"), ("armature", 0.02, "kg")) if inertia else ():
        value = float(getattr(m, f"actuator_{what}")[actuator])
        yield from_zero(f"{name}@actuation@{what}", f"actuator_{what}", name, value, share * inertia, unit)
    if m.actuator_forcelimited[actuator]:
        for i, side in enumerate(("low", "high")):
            limit = float(m.actuator_forcerange[actuator, i])
            yield times(f"{name}@actuation@force_{side}", f"actuator_forcerange[{i}]", name, limit, 0.3, 0.05, "N")


def _force(m: mujoco.MjModel, actuator: int, stem: str) -> Iterator[Candidate]:
    """The numbers of gain and bias."""
    name, gain, bias = m.actuator(actuator).name, m.actuator_gainprm[actuator], m.actuator_biasprm[actuator]
    places = forces(m, actuator)
    size = abs(float(gain[places[0]])) if places else 0.0
    if size and (any(bias[stiffness_of(m, actuator)]) or not scales_command(m, actuator)):
        yield times(f"{stem}servo_gain", "servo_gain", name, float(gain[places[0]]), 0.5, 0.05, "1")
    if scales_command(m, actuator):
        yield around(f"{stem}command_scale", "command_scale", name, 1.0, 0.3, 0.05, "1")
    if m.actuator_gaintype[actuator] == _GAIN.mjGAIN_DCMOTOR:
        for i, (what, unit) in enumerate((("resistance", "Ohm"), ("motor_constant", "N m/A"))):
            yield times(f"{stem}{what}", f"actuator_gainprm[{i}]", name, float(gain[i]), 0.5, 0.1, unit)
    if m.actuator_biastype[actuator] == _BIAS.mjBIAS_AFFINE:
        size = size or 1e-6
        yield around(f"{stem}offset", "actuator_biasprm[0]", name, float(bias[0]), 0.05 * size, 0.005 * size, "N")
        if bias[1] and bias[2]:
            yield times(f"{stem}servo_damping", "actuator_biasprm[2]", name, float(bias[2]), 0.5, 0.1, "1")


def _gear(m: mujoco.MjModel, actuator: int, name: str) -> Iterator[Candidate]:
    """Along each direction in which the drive acts."""
    for i in range(6):
        gear = float(m.actuator_gear[actuator, i])
        if gear and _directions(m, actuator) > i:
            word = f"_{i}" if _directions(m, actuator) > 1 else ""
            yield times(f"{name}{word}", f"actuator_gear[{i}]", m.actuator(actuator).name, gear, 0.3, 0.02, "1")


def _inertia(m: mujoco.MjModel, actuator: int) -> float:
    """What it moves at its joint or tendon; 0 where MuJoCo adds no inertia and no damping of the drive."""
    kind, target = int(m.actuator_trntype[actuator]), int(m.actuator_trnid[actuator, 0])
    if kind == _TRN.mjTRN_TENDON:
        return _mass_along(m, target)
    free = kind in _JOINT and m.jnt_type[target] == mujoco.mjtJoint.mjJNT_FREE
    in_parent = kind == _TRN.mjTRN_JOINTINPARENT and _directions(m, actuator) > 1
    return 0.0 if kind not in _JOINT or free or in_parent else float(m.dof_M0[m.jnt_dofadr[target]])


def _mass_along(m: mujoco.MjModel, tendon: int) -> float:
    return 1 / max(float(m.tendon_invweight0[tendon]), 1e-9)


def _directions(m: mujoco.MjModel, actuator: int) -> int:
    """How many numbers of a gear its transmission reads; an adhesion has no gear."""
    kind, target = int(m.actuator_trntype[actuator]), int(m.actuator_trnid[actuator, 0])
    if kind in (_TRN.mjTRN_SITE, _TRN.mjTRN_BODY):
        return 6 if kind == _TRN.mjTRN_SITE else 0
    sizes = {int(mujoco.mjtJoint.mjJNT_FREE): 6, int(mujoco.mjtJoint.mjJNT_BALL): 3}
    return sizes.get(int(m.jnt_type[target]), 1) if kind in _JOINT else 1


def tendon_fields(m: mujoco.MjModel, tendon: int) -> Iterator[Candidate]:
    """Friction, damping and inertia along it; limits, and a spring that does not rest where it was drawn."""
    name, inertia = m.tendon(tendon).name, _mass_along(m, tendon)
    for what, share, unit in (("damping", 0.05, "N s/m"), ("armature", 0.02, "kg"), ("frictionloss", 0.02, "N")):
        value = float(getattr(m, f"tendon_{what}")[tendon])
        yield from_zero(f"{name}@dyna@{what}", f"tendon_{what}", name, value, share * inertia, unit)
    stiffness = float(m.tendon_stiffness[tendon])
    if stiffness > 0:
        yield times(f"{name}@dyna@stiffness", "tendon_stiffness", name, stiffness, 0.5, 0.1, "N/m")
        for i, side in enumerate(("low", "high") if m.tendon_lengthspring[tendon, 0] >= 0 else ()):
            rest = float(m.tendon_lengthspring[tendon, i])
            yield around(f"{name}@dyna@spring_{side}", f"tendon_lengthspring[{i}]", name, rest, 0.02, 0.002, "m")
    if m.tendon_limited[tendon]:
        for i, side in enumerate(("low", "high")):
            at = float(m.tendon_range[tendon, i])
            yield around(f"{name}@shape@limit_{side}", f"tendon_range[{i}]", name, at, 0.02, 0.002, "m")

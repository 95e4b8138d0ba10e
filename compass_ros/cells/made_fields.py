"""Fields that are no array of mjModel: what one thing in the world changes in several places of the model.

| field | of | what it sets |
|---|---|---|
| `body_mass` | body | the mass, and the inertia in proportion |
| `geom_turn[axis]`, `body_turn[axis]` | geom, body | rotation [rad] about an axis of the parent, after the scene's |
| `inertia_turn[axis]` | body | the same of the axes of its inertia, about an axis of the body |
| `contact_solref[i]`, `contact_solimp[i]` | geom | a contact pair takes the mean of its two geoms |
| `contact_friction[i]` | geom | the same for sliding (0), turning (1) and rolling (2) friction |
| `body_moment[axis]` | body | second moment of its mass along a principal axis: the inertia about the other two |
| `inertia_log_cholesky[i]` | body | mass, centre and inertia of a real body, whatever the values: made_inertias.py |
| `joint_zero` | joint | what its encoder shows where the scene has the joint at zero |
| `servo_gain` | actuator | strength of a drive: its gain, and the bias that belongs to it in proportion |
| `command_scale` | actuator | share of the command that arrives |
| `table_friction`, `table_creep`, `table_load` | body | Coulomb friction of a body that slides on a table, as a force |
| `start_qpos[i]`, `start_qvel[i]` | joint | added to the first position or velocity of every episode |
| `observed_offset[i]` | object, signal | added to a tracked number: bias of a camera or encoder |
| `input_delay_s[i]`, `input_scale[i]`, `input_offset[i]` | input | how late it acts; a factor; what is added after it |
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from compass_ros.cells.made_drives import Writer, command, strength, whole_command
from compass_ros.cells.made_inertias import deformed, moments
from compass_ros.errors import ConfigError
from compass_ros.types import Floats

OUTSIDE = ("table_friction", "table_creep", "table_load", "start_qpos", "start_qvel", "observed_offset",
           "input_delay_s", "input_scale", "input_offset")  # fmt: skip
"""Made fields that act outside of the model."""


@dataclass(frozen=True)
class Made:
    """One parameter that is a made field."""

    column: int
    """Of the values."""
    name: str
    index: int
    row: int
    """Of the element in the arrays of its kind."""


ELEMENT = {
    "body_mass": "body",
    "body_moment": "body",
    "inertia_log_cholesky": "body",
    "body_turn": "body",
    "geom_turn": "geom",
    "inertia_turn": "body",
    "contact_solref": "geom",
    "contact_solimp": "geom",
    "contact_friction": "geom",
    "joint_zero": "qpos",
    "servo_gain": "actuator",
    "command_scale": "actuator",
}
"""Kind of the element of each made field."""
TURNED = {"geom_turn": "geom_quat", "body_turn": "body_quat", "inertia_turn": "body_iquat"}
"""The quaternions that are turned."""
WHOLE = "inertia_log_cholesky"
PARTS = {"body_mass", "body_moment", "inertia_turn", "body_ipos", "body_inertia", "body_iquat"}
"""What says a part of what that says."""


def early_writers(scene: mujoco.MjModel, made: Sequence[Made], where: str) -> list[Writer]:
    """Writers that go before the plain fields, for the scene at its defaults. Raises ConfigError."""
    masses = [_mass(scene, m) for m in made if m.name == "body_mass"]
    zeros = [_zero(scene, m) for m in made if m.name == "joint_zero"]
    moments = [_moments(scene, body, made) for body in sorted({m.row for m in made if m.name == "body_moment"})]
    whole = [_whole(scene, body, made, where) for body in sorted({m.row for m in made if m.name == WHOLE})]
    scaled, driven = ([m for m in made if m.name == name] for name in ("command_scale", "servo_gain"))
    gains = [whole_command(scene, m.row, f"{where}: {m.name}") for m in scaled]
    strengths = [strength(scene, m.row, m.column, f"{where}: {m.name}") for m in driven]
    return masses + zeros + moments + whole + gains + strengths


def late_writers(scene: mujoco.MjModel, made: Sequence[Made], where: str) -> list[Writer]:
    """Writers that go after the plain fields. Raises ConfigError."""
    turns = [_turn(scene, name, made) for name in TURNED if any(m.name == name for m in made)]
    commands = [command(scene, m.row, m.column) for m in made if m.name == "command_scale"]
    return turns + _mixtures(scene, [m for m in made if m.name.startswith("contact_")], where) + commands


def _mass(scene: mujoco.MjModel, made: Made) -> Writer:
    mass, inertia = float(scene.body_mass[made.row]), scene.body_inertia[made.row].copy()

    def write(model: mujoco.MjModel, values: Floats) -> None:
        model.body_mass[made.row] = values[made.column]
        model.body_inertia[made.row] = inertia * (values[made.column] / mass if mass else 1.0)

    return write


def _moments(scene: mujoco.MjModel, body: int, made: Sequence[Made]) -> Writer:
    own = [m for m in made if m.name == "body_moment" and m.row == body]
    inertia = scene.body_inertia[body].copy()
    nominal, axes, columns = moments(inertia), [m.index for m in own], [m.column for m in own]

    def write(model: mujoco.MjModel, values: Floats) -> None:
        more = np.zeros(3)
        more[axes] = values[columns] - nominal[axes]
        model.body_inertia[body] = inertia + (more.sum() - more)

    return write


def _whole(scene: mujoco.MjModel, body: int, made: Sequence[Made], where: str) -> Writer:
    own = [m for m in made if m.name == WHOLE and m.row == body]
    return deformed(body, scene, [m.column for m in own], [m.index for m in own], where)


def _zero(scene: mujoco.MjModel, made: Made) -> Writer:
    nominal = float(scene.qpos0[made.row])

    def write(model: mujoco.MjModel, values: Floats) -> None:
        model.qpos0[made.row] = nominal + values[made.column]

    return write


def _turn(scene: mujoco.MjModel, name: str, made: Sequence[Made]) -> Writer:
    array = TURNED[name]
    own: dict[int, list[Made]] = {}
    for m in made:
        if m.name == name:
            own.setdefault(m.row, []).append(m)
    nominal = {row: getattr(scene, array)[row].copy() for row in own}

    def write(model: mujoco.MjModel, values: Floats) -> None:
        for row, turned in own.items():
            vector, turn = np.zeros(3), np.zeros(4)
            for m in turned:
                vector[m.index] = values[m.column]
            angle = float(np.linalg.norm(vector))
            mujoco.mju_axisAngle2Quat(turn, vector / angle if angle else np.array([0.0, 0.0, 1.0]), angle)
            mujoco.mju_mulQuat(getattr(model, array)[row], turn, nominal[row])

    return write


_FRICTION: tuple[list[int], ...] = ([0, 1], [2], [3, 4])
"""Numbers of a pair's friction that are sliding, turning and rolling friction, in the order of a geom's."""


def _mixtures(scene: mujoco.MjModel, made: Sequence[Made], where: str) -> list[Writer]:
    """One writer for each number of a pair that is mixed from its two geoms."""
    writers = []
    partners = np.stack([scene.pair_geom1, scene.pair_geom2], axis=1)
    for name, index in sorted({(m.name, m.index) for m in made}):
        array = name.replace("contact_", "pair_")
        own = [m for m in made if (m.name, m.index) == (name, index)]
        share = 0.5 * np.stack([(partners == m.row).sum(axis=1) for m in own], axis=1)  # (npair, parameters)
        if not share.any(axis=0).all():
            raise ConfigError(f"{where}: {name}: a geom that is in no contact pair; list pairs under <contact>")
        numbers = _FRICTION if array == "pair_friction" else tuple([i] for i in range(getattr(scene, array).shape[1]))
        if index >= len(numbers):
            raise ConfigError(f"{where}: field: {name} has {len(numbers)} numbers, found index {index}")
        rest = (1 - share.sum(axis=1)) * getattr(scene, array)[:, numbers[index][0]]
        writers.append(_mixture(array, numbers[index], share, rest, [m.column for m in own]))
    return writers


def _mixture(array: str, numbers: list[int], share: Floats, rest: Floats, columns: list[int]) -> Writer:
    def write(model: mujoco.MjModel, values: Floats) -> None:
        getattr(model, array)[:, numbers] = (share @ values[columns] + rest)[:, None]

    return write

"""Fields that are no array of mjModel: what one thing in the world changes in several places of the model.

| field | of | what it sets |
|---|---|---|
| `body_mass` | body | the mass, and the inertia in proportion |
| `geom_turn[axis]`, `body_turn[axis]` | geom, body | rotation [rad] about an axis of the parent, after the scene's |
| `inertia_turn[axis]` | body | the same of the axes of its inertia, about an axis of the body |
| `contact_solref[i]`, `contact_solimp[i]` | geom | a contact pair takes the mean of its two geoms |
| `contact_friction[i]` | geom | the same for sliding (0), turning (1) and rolling (2) friction |
| `servo_gain` | actuator | gain of a position or velocity servo: gainprm[0] and the bias that belongs to it |
| `command_scale` | actuator | share of the command that arrives |
| `table_friction`, `table_creep`, `table_load` | body | Coulomb friction of a body that slides on a table, as a force |
| `start_qpos[i]`, `start_qvel[i]` | joint | added to the first position or velocity of every episode |
| `observed_offset[i]` | object | added to a tracked number: bias of a camera or encoder |
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from compass_ros.errors import ConfigError
from compass_ros.types import Floats

Writer = Callable[[mujoco.MjModel, Floats], None]
"""Writes (P,) values into a model."""
OUTSIDE = ("table_friction", "table_creep", "table_load", "start_qpos", "start_qvel", "observed_offset")
"""Made fields that act outside of the model."""
_GEOM = mujoco.mjtGeom


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
    "body_turn": "body",
    "geom_turn": "geom",
    "inertia_turn": "body",
    "contact_solref": "geom",
    "contact_solimp": "geom",
    "contact_friction": "geom",
    "servo_gain": "actuator",
    "command_scale": "actuator",
}
"""Kind of the element of each made field."""
TURNED = {"geom_turn": "geom_quat", "body_turn": "body_quat", "inertia_turn": "body_iquat"}
"""The quaternions that are turned."""


def early_writers(scene: mujoco.MjModel, made: Sequence[Made]) -> list[Writer]:
    """Writers that go before the plain fields, for the scene at its defaults."""
    masses = [_mass(scene, m) for m in made if m.name == "body_mass"]
    return masses + [_servo(scene, m) for m in made if m.name == "servo_gain"]


def late_writers(scene: mujoco.MjModel, made: Sequence[Made], where: str) -> list[Writer]:
    """Writers that go after the plain fields. Raises ConfigError."""
    turns = [_turn(scene, name, made) for name in TURNED if any(m.name == name for m in made)]
    commands = [_command(scene, m) for m in made if m.name == "command_scale"]
    return turns + _mixtures(scene, [m for m in made if m.name.startswith("contact_")], where) + commands


def _mass(scene: mujoco.MjModel, made: Made) -> Writer:
    mass, inertia = float(scene.body_mass[made.row]), scene.body_inertia[made.row].copy()

    def write(model: mujoco.MjModel, values: Floats) -> None:
        model.body_mass[made.row] = values[made.column]
        model.body_inertia[made.row] = inertia * (values[made.column] / mass if mass else 1.0)

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


def _servo(scene: mujoco.MjModel, made: Made) -> Writer:
    bias = _bias_index(scene, made.row)

    def write(model: mujoco.MjModel, values: Floats) -> None:
        model.actuator_gainprm[made.row, 0] = values[made.column]
        model.actuator_biasprm[made.row, bias] = -values[made.column]

    return write


def _command(scene: mujoco.MjModel, made: Made) -> Writer:
    bias, gain = _bias_index(scene, made.row), float(scene.actuator_gainprm[made.row, 0])
    servo = bool(scene.actuator_biasprm[made.row, bias])

    def write(model: mujoco.MjModel, values: Floats) -> None:
        full = -model.actuator_biasprm[made.row, bias] if servo else gain
        model.actuator_gainprm[made.row, 0] = values[made.column] * full

    return write


def _bias_index(scene: mujoco.MjModel, actuator: int) -> int:
    """Where a servo's gain stands in biasprm: 1 for a position servo, 2 for a velocity servo."""
    return 1 if scene.actuator_biasprm[actuator, 1] else 2


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


def bounding(scene: mujoco.MjModel, geom: int, where: str) -> Callable[[mujoco.MjModel], None]:
    """What keeps a geom's bounding radius and box in step with its size. Raises ConfigError for meshes."""
    kind = int(scene.geom_type[geom])
    half = _HALF_SIZES.get(kind)
    if half is None:
        name = scene.geom(geom).name
        raise ConfigError(f"{where}: geom_size: geom '{name}' is a mesh or a height field, without a size")

    def write(model: mujoco.MjModel) -> None:
        if kind == _GEOM.mjGEOM_PLANE:
            return
        size = model.geom_size[geom]
        model.geom_aabb[geom, 3:] = half(size)
        model.geom_rbound[geom] = _radius(kind, size)

    return write


_HALF_SIZES: dict[int, Callable[[Floats], Floats]] = {
    int(_GEOM.mjGEOM_PLANE): lambda s: s,
    int(_GEOM.mjGEOM_SPHERE): lambda s: np.full(3, s[0]),
    int(_GEOM.mjGEOM_CAPSULE): lambda s: np.array([s[0], s[0], s[0] + s[1]]),
    int(_GEOM.mjGEOM_CYLINDER): lambda s: np.array([s[0], s[0], s[1]]),
    int(_GEOM.mjGEOM_ELLIPSOID): lambda s: s,
    int(_GEOM.mjGEOM_BOX): lambda s: s,
}


def _radius(kind: int, size: Floats) -> float:
    if kind == _GEOM.mjGEOM_SPHERE:
        return float(size[0])
    if kind == _GEOM.mjGEOM_CAPSULE:
        return float(size[0] + size[1])
    if kind == _GEOM.mjGEOM_CYLINDER:
        return float(np.hypot(size[0], size[1]))
    return float(size.max() if kind == _GEOM.mjGEOM_ELLIPSOID else np.linalg.norm(size))

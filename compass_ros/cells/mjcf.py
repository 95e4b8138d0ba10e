"""A cell without code: any MuJoCo scene, and a YAML that says which of its fields, joints and actuators mean what."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import mujoco
import numpy as np

from compass_ros.cells.bindings import Command, Start, offsets, shift
from compass_ros.cells.cell import Cell
from compass_ros.cells.dynamics import Sliding
from compass_ros.cells.fields import Fields, names, rows
from compass_ros.cells.spec import ObjectSpec, ParameterSpec
from compass_ros.cells.start import input_names
from compass_ros.errors import ConfigError, nearest
from compass_ros.types import QUANTITY_SIZE, Floats, Ints

_STATE = mujoco.mjtState.mjSTATE_FULLPHYSICS.value
_FREE = int(mujoco.mjtJoint.mjJNT_FREE)
_NUDGE_M = 1e-9
_TABLE = {"table_friction": None, "table_creep": 0.002, "table_load": 1.0}
"""Fields of a sliding body, with what is taken where the YAML has none."""


class Mjcf:
    """`Dynamics` of a scene that its YAML describes. Raises ConfigError where the YAML and the scene differ."""

    def __init__(self, cell: Cell) -> None:
        self._cell = cell
        self._where = str(cell.path)
        self._model = _compiled(cell)
        for p in cell.spec.parameters:
            if not p.field:
                raise ConfigError(f"{self._where}: {p.name}: field: missing; say which field of the scene it is")
        self._fields = Fields(self._model, list(enumerate(cell.spec.parameters)), self._where)
        self._first = _first_positions(self._model)
        self._commands = [Command(self._model, i, a, self._where) for i, a in enumerate(cell.spec.action)]
        self._starts = _starts(cell, self._model)
        self._columns = np.concatenate([_columns(self._model, o, self._where) for o in cell.objects]).astype(np.int64)
        self._sliding = _table_fields(self._model, cell.spec.parameters, self._where)
        numbered = list(enumerate(cell.spec.parameters))
        self._shifts = [shift(self._model, i, p, self._where) for i, p in numbered if p.field.startswith("start_")]
        biased = [(i, p) for i, p in numbered if p.field.startswith("observed_offset")]
        columns = {name: start.column for name, start in self._starts.items()}
        self._offsets = [offset for i, p in biased for offset in offsets(cell, i, p, columns)]

    @property
    def model(self) -> mujoco.MjModel:
        return self._model

    def apply(self, models: Sequence[mujoco.MjModel], values: Floats) -> None:
        self._fields.write(models, values)

    def start(self, values: Floats, inputs: Floats) -> tuple[Floats, Floats]:
        positions = np.tile(self._first, (len(values), 1))
        velocities = np.zeros((len(values), self._model.nv))
        true = inputs.copy()
        for offset in self._offsets:
            if offset.first is not None:
                true[:, offset.first] -= values[:, offset.parameter]
        for start in self._starts.values():
            start.write(true, positions, velocities)
        for command in self._commands:
            command.begin(inputs, positions, velocities)
        for s in self._shifts:
            (positions if s.of_positions else velocities)[:, s.places] += values[:, s.parameter, None]
        return positions, velocities

    def controls(self, values: Floats, inputs: Floats, steps: int) -> Floats:
        controls = np.zeros((len(values), steps, self._model.nu))
        time = self._model.opt.timestep * np.arange(steps)
        for command in self._commands:
            command.hold(inputs, time, controls)
        return controls

    def sliding(self, values: Floats) -> tuple[Sliding, ...]:
        out = []
        for body, of_field in self._sliding.items():
            numbers = [
                values[:, of_field[name]] if name in of_field else np.full(len(values), default)
                for name, default in _TABLE.items()
            ]
            out.append(Sliding(body, *numbers))
        return tuple(out)

    def columns(self) -> Ints:
        return self._columns

    def observe(self, values: Floats, positions: Floats) -> Floats:
        if not self._offsets:
            return positions
        moved = positions.copy()
        for offset in self._offsets:
            moved[:, :, offset.column] += values[:, offset.parameter, None]
        return moved

    def poses(self, values: Floats, positions: Floats) -> Mapping[str, Floats]:
        return {}  # which bodies move in a plane is not known here


def _starts(cell: Cell, model: mujoco.MjModel) -> dict[str, Start]:
    """First states by object, in the order of the inputs."""
    out, column = {}, len(cell.action)
    for spec in cell.spec.start:
        obj = next(o for o in cell.objects if o.name == spec.object)
        out[obj.name] = Start(model, obj, column, str(cell.path))
        column += len(input_names(spec, obj.quantity))
    return out


def _first_positions(model: mujoco.MjModel) -> Floats:
    """Joint positions at the start: the keyframe `start` where the scene has one, else those of the drawing."""
    keys = [model.key(i).name for i in range(model.nkey)]
    return np.asarray(model.key("start").qpos if "start" in keys else model.qpos0, np.float64) + 0.0


def _table_fields(model: mujoco.MjModel, parameters: Sequence[ParameterSpec], where: str) -> dict[str, dict[str, int]]:
    """body -> field -> parameter, of the bodies that slide on a table. Raises ConfigError."""
    out: dict[str, dict[str, int]] = {}
    for i, p in enumerate(parameters):
        if p.field in _TABLE:
            rows(model, "body", p.of, f"{where}: {p.name}")
            out.setdefault(p.of, {})[p.field] = i
    for body, fields in out.items():
        if "table_friction" not in fields:
            raise ConfigError(f"{where}: body '{body}' has a table_creep or table_load but no table_friction")
    return out


def _columns(model: mujoco.MjModel, obj: ObjectSpec, where: str) -> Ints:
    """Where an object's numbers stand in a row of (qpos, qvel, act, sensordata)."""
    name, size = obj.body or obj.name, QUANTITY_SIZE[obj.quantity]
    if obj.quantity == "joint":
        return rows(model, "qpos", name, f"{where}: objects: {obj.name}")[:1]
    free = _free_address(model, name)
    if free is not None:
        return np.arange(free, free + size)
    first = mujoco.mj_stateSize(model, _STATE) - 1
    position = first + int(model.sensor(_sensor(obj, "position")).adr[0])
    orientation = first + int(model.sensor(_sensor(obj, "orientation")).adr[0])
    return np.concatenate([position + np.arange(min(size, 3)), orientation + np.arange(size - min(size, 3))])


def _free_address(model: mujoco.MjModel, body: str) -> int | None:
    identity = model.body(body).id
    first = int(model.body_jntadr[identity])
    free = model.body_jntnum[identity] == 1 and int(model.jnt_type[first]) == _FREE
    return int(model.jnt_qposadr[first]) if free else None


def _sensor(obj: ObjectSpec, what: str) -> str:
    return f"compass/{obj.name}/{what}"


def _compiled(cell: Cell) -> mujoco.MjModel:
    """The scene, with sensors for what is tracked. Raises ConfigError with MuJoCo's own words in one line."""
    try:
        spec = mujoco.MjSpec.from_file(str(cell.model_path))
        nominal = spec.compile()
    except ValueError as error:
        raise ConfigError(f"{cell.model_path}: {' '.join(str(error).split())}") from error
    bodies = names(nominal, mujoco.mjtObj.mjOBJ_BODY)
    for obj in cell.objects:
        name = obj.body or obj.name
        if obj.quantity == "joint":
            continue
        if name not in bodies:
            hint = nearest(name, bodies)
            raise ConfigError(f"{cell.path}: objects: the scene has no body '{name}'; it has {', '.join(bodies)}{hint}")
        for what, kind in (("position", "FRAMEPOS"), ("orientation", "FRAMEQUAT")):
            sensor = spec.add_sensor()
            sensor.name, sensor.type = _sensor(obj, what), getattr(mujoco.mjtSensor, f"mjSENS_{kind}")
            sensor.objtype, sensor.objname = mujoco.mjtObj.mjOBJ_XBODY, name
    _unsimplify(spec, nominal, cell.spec.parameters)
    return spec.compile()


def _unsimplify(spec: mujoco.MjSpec, nominal: mujoco.MjModel, parameters: Sequence[ParameterSpec]) -> None:
    """Bodies whose inertial frame or joint's place is tuned: MuJoCo must not take their inertia matrix for diagonal."""
    for p in parameters:
        if p.field.startswith(("body_ipos", "body_iquat", "inertia_turn")):
            tuned = [one.strip() for one in p.of.split(",")]
        elif p.field.startswith(("jnt_pos", "jnt_axis")):
            found = [mujoco.mj_name2id(nominal, mujoco.mjtObj.mjOBJ_JOINT, one.strip()) for one in p.of.split(",")]
            tuned = [nominal.body(nominal.jnt_bodyid[joint]).name for joint in found if joint >= 0]
        else:
            continue
        for name in tuned:
            body = spec.body(name)
            if body is not None:
                own = nominal.body(name)
                body.explicitinertial = True
                body.mass, body.inertia, body.iquat = float(own.mass[0]), own.inertia, own.iquat
                body.ipos = own.ipos + _NUDGE_M

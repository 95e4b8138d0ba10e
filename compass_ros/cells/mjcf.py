"""A cell without code: any MuJoCo scene, and a YAML that says which of its fields, joints and actuators mean what."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import mujoco
import numpy as np

from compass_ros.cells.cell import Cell
from compass_ros.cells.dynamics import Sliding
from compass_ros.cells.fields import Fields, names, parse, rows
from compass_ros.cells.spec import ActionSpec, ObjectSpec, ParameterSpec
from compass_ros.cells.start import STATE, TURN
from compass_ros.errors import ConfigError, nearest
from compass_ros.types import QUANTITY_SIZE, Floats, Ints

_STATE = mujoco.mjtState.mjSTATE_FULLPHYSICS.value
_FREE, _SLIDE = int(mujoco.mjtJoint.mjJNT_FREE), int(mujoco.mjtJoint.mjJNT_SLIDE)
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
        self._commands = [_Command(self._model, i, a, self._where) for i, a in enumerate(cell.spec.action)]
        self._starts = self._bound_starts()
        self._columns = np.concatenate([_columns(self._model, o, self._where) for o in cell.objects]).astype(np.int64)
        self._sliding = _table_fields(cell.spec.parameters)
        for body in self._sliding:
            rows(self._model, "body", body, self._where)
            if "table_friction" not in self._sliding[body]:
                raise ConfigError(f"{self._where}: body '{body}' has a table_creep or table_load but no table_friction")
        self._offsets = self._offset_columns()
        self._begins = [(i, *_begin(self._model, p, self._where)) for i, p in enumerate(cell.spec.parameters)
                        if p.field.startswith("start_")]  # fmt: skip

    @property
    def model(self) -> mujoco.MjModel:
        return self._model

    def apply(self, models: Sequence[mujoco.MjModel], values: Floats) -> None:
        self._fields.write(models, values)

    def start(self, values: Floats, inputs: Floats) -> tuple[Floats, Floats]:
        positions = np.tile(self._first, (len(values), 1))
        velocities = np.zeros((len(values), self._model.nv))
        for start in self._starts:
            start.write(inputs, positions, velocities)
        for command in self._commands:
            command.begin(inputs, positions, velocities)
        for parameter, of_positions, places in self._begins:
            (positions if of_positions else velocities)[:, places] += values[:, parameter, None]
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
        for column, parameter in self._offsets:
            moved[:, :, column] += values[:, parameter, None]
        return moved

    def poses(self, values: Floats, positions: Floats) -> Mapping[str, Floats]:
        return {}  # which bodies move in a plane is not known here

    def _bound_starts(self) -> list[_Start]:
        out, column = [], len(self._cell.action)
        for spec in self._cell.spec.start:
            obj = next(o for o in self._cell.objects if o.name == spec.object)
            out.append(_Start(self._model, obj, column, self._where))
            column += len(STATE[obj.quantity]) + (len(TURN) if obj.quantity == "pose" else 0)
        return out

    def _offset_columns(self) -> list[tuple[int, int]]:
        """(observed column, parameter) of each bias."""
        out = []
        for i, p in enumerate(self._cell.spec.parameters):
            name, index = parse(p.field, f"{self._where}: {p.name}")
            if name != "observed_offset":
                continue
            chosen = [o.name for o in self._cell.objects] if not p.of else [one.strip() for one in p.of.split(",")]
            at = 0
            for o in self._cell.objects:
                if o.name in chosen:
                    size = QUANTITY_SIZE[o.quantity]
                    if (index or 0) >= size:
                        raise ConfigError(
                            f"{self._where}: {p.name}: '{o.name}' has {size} numbers, found index {index}"
                        )
                    out.append((at + (index or 0), i))
                at += QUANTITY_SIZE[o.quantity]
            unknown = set(chosen) - {o.name for o in self._cell.objects}
            if unknown:
                raise ConfigError(f"{self._where}: {p.name}: of: unknown object {sorted(unknown)}")
        return out


class _Command:
    """One field of an action."""

    def __init__(self, model: mujoco.MjModel, column: int, spec: ActionSpec, where: str) -> None:
        here = f"{where}: action {spec.name}"
        name, _, index = spec.field.rstrip("]").partition("[")
        if name not in ("qpos", "qvel", "ctrl") or (index and not index.isdigit()):
            raise ConfigError(f"{here}: field: expected qpos[i], qvel[i] or ctrl, found '{spec.field}'")
        kind = {"qpos": "qpos", "qvel": "dof", "ctrl": "actuator"}[name]
        places = rows(model, kind, spec.of, here)
        if int(index or 0) >= len(places):
            raise ConfigError(f"{here}: field: '{spec.of}' has {len(places)} numbers, found index {index}")
        self._name, self._column, self._place = name, column, int(places[int(index or 0)])
        self._from, self._until = spec.from_s, spec.until_s

    def begin(self, inputs: Floats, positions: Floats, velocities: Floats) -> None:
        if self._name != "ctrl":
            (positions if self._name == "qpos" else velocities)[:, self._place] = inputs[:, self._column]

    def hold(self, inputs: Floats, time: Floats, controls: Floats) -> None:
        if self._name == "ctrl":
            now = (time >= self._from - 1e-9) & (time < self._until - 1e-9)
            controls[:, now, self._place] += inputs[:, self._column, None]


class _Start:
    """The first state of one object, from the inputs."""

    def __init__(self, model: mujoco.MjModel, obj: ObjectSpec, column: int, where: str) -> None:
        self._quantity, self._column = obj.quantity, column
        here, name = f"{where}: start: {obj.name}", obj.body or obj.name
        if obj.quantity == "joint":
            self._qpos, self._qvel = (int(rows(model, kind, name, here)[0]) for kind in ("qpos", "dof"))
            return
        body = int(rows(model, "body", name, here)[0])
        joints = range(model.body_jntadr[body], model.body_jntadr[body] + model.body_jntnum[body])
        kinds = [int(model.jnt_type[j]) for j in joints]
        self._free = kinds == [_FREE]
        if not kinds or not (self._free or (set(kinds) == {_SLIDE} and obj.quantity != "pose")):
            wanted = "a free joint" if obj.quantity == "pose" else "a free joint or slide joints"
            raise ConfigError(f"{here}: body '{name}' needs {wanted} to start where it was measured")
        self._qpos, self._qvel = int(model.jnt_qposadr[joints[0]]), int(model.jnt_dofadr[joints[0]])
        self._axes, self._rest = _frame(model, body, joints)

    def write(self, inputs: Floats, positions: Floats, velocities: Floats) -> None:
        state = inputs[:, self._column :]
        if self._quantity == "joint":
            positions[:, self._qpos], velocities[:, self._qvel] = state[:, 0], state[:, 1]
            return
        size = min(QUANTITY_SIZE[self._quantity], 3)
        at = self._qpos + np.arange(size)
        if self._quantity == "pose":
            positions[:, at] = state[:, :3]
            positions[:, self._qpos + 3 : self._qpos + 7] = _turned(state[:, 3:7], state[:, 13:16])
            velocities[:, self._qvel : self._qvel + 6] = state[:, 7:13]
        elif self._free:
            positions[:, at] = state[:, :size]
            velocities[:, self._qvel + np.arange(size)] = state[:, size : 2 * size]
        else:
            axes = self._axes[:, :size]
            slides = np.arange(len(axes))
            positions[:, self._qpos + slides] = (state[:, :size] - self._rest[:size]) @ axes.T
            velocities[:, self._qvel + slides] = state[:, size : 2 * size] @ axes.T


def _begin(model: mujoco.MjModel, spec: ParameterSpec, where: str) -> tuple[bool, Ints]:
    """Whether a parameter shifts first positions (or velocities), and which."""
    name, index = parse(spec.field, f"{where}: {spec.name}")
    of_positions = name == "start_qpos"
    places = rows(model, "qpos" if of_positions else "dof", spec.of, f"{where}: {spec.name}")
    if (index or 0) >= len(places):
        raise ConfigError(f"{where}: {spec.name}: field: '{spec.of}' has {len(places)} numbers, found index {index}")
    return of_positions, places if index is None else places[[index]]


def _frame(model: mujoco.MjModel, body: int, joints: range) -> tuple[Floats, Floats]:
    """(J, 3) axes of slide joints in the world and (3,) place of the body, both with all joints at zero."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return data.xaxis[list(joints)].copy(), data.xpos[body].copy()


def _turned(quaternion: Floats, vector: Floats) -> Floats:
    """(B, 4) quaternions, normalised, then turned by (B, 3) rotation vectors in the body's frame."""
    unit: Floats = quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True)
    out = np.zeros(unit.shape)
    for i, (q, v) in enumerate(zip(unit, vector, strict=True)):
        angle, turn = float(np.linalg.norm(v)), np.zeros(4)
        mujoco.mju_axisAngle2Quat(turn, v / angle if angle else np.array([0.0, 0.0, 1.0]), angle)
        mujoco.mju_mulQuat(out[i], q, turn)
    return out


def _first_positions(model: mujoco.MjModel) -> Floats:
    """Joint positions at the start: the keyframe `start` where the scene has one, else those of the drawing."""
    keys = [model.key(i).name for i in range(model.nkey)]
    return np.asarray(model.key("start").qpos if "start" in keys else model.qpos0, np.float64) + 0.0


def _table_fields(parameters: Sequence[ParameterSpec]) -> dict[str, dict[str, int]]:
    """body -> field -> parameter, of the bodies that slide on a table."""
    out: dict[str, dict[str, int]] = {}
    for i, p in enumerate(parameters):
        if p.field in _TABLE:
            out.setdefault(p.of, {})[p.field] = i
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
        if p.field.startswith(("body_ipos", "body_iquat")):
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

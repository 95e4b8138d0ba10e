"""What a YAML names, bound to the scene: actions, first states, and what parameters do outside of the model."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np

from compass_ros.cells.cell import Cell
from compass_ros.cells.fields import parse, rows, rows_of
from compass_ros.cells.signals import Signal
from compass_ros.cells.spec import ActionSpec, ParameterSpec
from compass_ros.errors import ConfigError
from compass_ros.types import Bools, Floats, Ints

_FREE, _SLIDE = int(mujoco.mjtJoint.mjJNT_FREE), int(mujoco.mjtJoint.mjJNT_SLIDE)


class Command:
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

    def drive(self, time: Floats, driven: Bools) -> None:
        """Mark in (T, nu) when it says what its actuator is told, instead of the keyframe."""
        if self._name == "ctrl":
            driven[self._now(time), self._place] = True

    def hold(self, inputs: Floats, time: Floats, controls: Floats) -> None:
        if self._name == "ctrl":
            controls[:, self._now(time), self._place] += inputs[:, self._column, None]

    def _now(self, time: Floats) -> Bools:
        return np.asarray((time >= self._from - 1e-9) & (time < self._until - 1e-9))


class Start:
    """The first state of one object or signal, from the inputs."""

    def __init__(self, model: mujoco.MjModel, signal: Signal, column: int, where: str) -> None:
        self._signal, self.column = signal, column
        here, name = f"{where}: start: {signal.name}", signal.at[0]
        if signal.jointed:
            self._joints, self._rates = (
                np.array([rows(model, kind, joint, here)[0] for joint in signal.at]) for kind in ("qpos", "dof")
            )
            return
        if not signal.places:
            raise ConfigError(f"{here}: a {signal.quantity} does not say where anything is")
        body = int(rows(model, "body", name, here)[0])
        joints = range(model.body_jntadr[body], model.body_jntadr[body] + model.body_jntnum[body])
        kinds = [int(model.jnt_type[j]) for j in joints]
        self._free = kinds == [_FREE]
        if not kinds or not (self._free or (set(kinds) == {_SLIDE} and signal.quantity != "pose")):
            wanted = "a free joint" if signal.quantity == "pose" else "a free joint or slide joints"
            raise ConfigError(f"{here}: body '{name}' needs {wanted} to start where it was measured")
        self._qpos, self._qvel = int(model.jnt_qposadr[joints[0]]), int(model.jnt_dofadr[joints[0]])
        self._axes, self._rest = _frame(model, body, joints)

    def write(self, inputs: Floats, positions: Floats, velocities: Floats) -> None:
        state = inputs[:, self.column :]
        if self._signal.jointed:
            count = len(self._joints)
            positions[:, self._joints], velocities[:, self._rates] = state[:, :count], state[:, count : 2 * count]
            return
        size = min(self._signal.size, 3)
        at = self._qpos + np.arange(size)
        if self._signal.quantity == "pose":
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


@dataclass(frozen=True)
class Shift:
    """A parameter that is added to first positions or velocities."""

    parameter: int
    of_positions: bool
    places: Ints
    """In qpos or qvel."""


def shift(model: mujoco.MjModel, parameter: int, spec: ParameterSpec, where: str) -> Shift:
    """Bind `start_qpos[i]` or `start_qvel[i]` of a joint. Raises ConfigError."""
    name, index = parse(spec.field, f"{where}: {spec.name}")
    of_positions = name == "start_qpos"
    places = rows_of(model, "qpos" if of_positions else "dof", spec.of, f"{where}: {spec.name}")
    if (index or 0) >= len(places):
        raise ConfigError(f"{where}: {spec.name}: field: '{spec.of}' has {len(places)} numbers, found index {index}")
    return Shift(parameter, of_positions, places if index is None else places[[index]])


@dataclass(frozen=True)
class Offset:
    """A parameter that is added to an observed column, and so to the first position that this sensor has measured."""

    parameter: int
    column: int
    """Of an observation."""
    first: int | None
    """Column of the inputs that holds this number's first value; None where the episode does not bring it."""


def offsets(cell: Cell, parameter: int, spec: ParameterSpec, starts: dict[str, int]) -> list[Offset]:
    """Bind `observed_offset[i]` of objects; `starts`: first column of each object's first state. Raises ConfigError."""
    here = f"{cell.path}: {spec.name}"
    index = parse(spec.field, here)[1] or 0
    known = [s.name for s in cell.signals]
    chosen = [one.strip() for one in spec.of.split(",")] if spec.of else known
    unknown = sorted(set(chosen) - set(known))
    if unknown:
        raise ConfigError(f"{here}: of: unknown object {', '.join(unknown)}; known: {', '.join(known)}")
    out = []
    for s in cell.signals:
        if s.name in chosen:
            if index >= s.size:
                raise ConfigError(f"{here}: '{s.name}' has {s.size} numbers, found index {index}")
            out.append(Offset(parameter, s.first + index, starts[s.name] + index if s.name in starts else None))
    return out

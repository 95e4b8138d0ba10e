"""A cell without code: any MuJoCo scene, and a YAML that says which of its fields, joints and actuators mean what."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import mujoco
import numpy as np

from compass_ros.cells.bindings import Command, Start, offsets, shift
from compass_ros.cells.cell import Cell
from compass_ros.cells.dynamics import Sliding
from compass_ros.cells.fields import Fields, rows
from compass_ros.cells.keyframe import begun, first_state, place_mocap
from compass_ros.cells.scene import compiled
from compass_ros.cells.sensors import columns_of
from compass_ros.cells.spec import ParameterSpec
from compass_ros.cells.start import input_names
from compass_ros.errors import ConfigError
from compass_ros.types import Floats, Ints

_TABLE = {"table_friction": None, "table_creep": 0.002, "table_load": 1.0}
"""Fields of a sliding body, with what is taken where the YAML has none."""


class Mjcf:
    """`Dynamics` of a scene that its YAML describes. Raises ConfigError where the YAML and the scene differ."""

    def __init__(self, cell: Cell) -> None:
        self._cell = cell
        self._where = str(cell.path)
        self._model, self._rests_as_drawn = compiled(cell)
        for p in cell.spec.parameters:
            if not p.field:
                raise ConfigError(f"{self._where}: {p.name}: field: missing; say which field of the scene it is")
        data = begun(self._model)
        place_mocap(self._model, data)
        self._first, self._positions, self._velocities = first_state(data, self._model), data.qpos, data.qvel
        self._idle = data.ctrl
        self._fields = Fields(self._model, list(enumerate(cell.spec.parameters)), self._where)
        self._commands = [Command(self._model, i, a, self._where) for i, a in enumerate(cell.spec.action)]
        self._starts = _starts(cell, self._model)
        self._columns = np.concatenate([columns_of(self._model, s, self._where) for s in cell.signals]).astype(np.int64)
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
        for model in models:
            model.tendon_lengthspring[self._rests_as_drawn] = -1
        self._fields.write(models, values)
        for model in models if len(self._rests_as_drawn) else ():
            _measure_rests(model)

    @property
    def first(self) -> Floats:
        return self._first

    def start(self, values: Floats, inputs: Floats) -> tuple[Floats, Floats]:
        positions, velocities = (np.tile(of, (len(values), 1)) for of in (self._positions, self._velocities))
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
        time = self._model.opt.timestep * np.arange(steps)
        driven = np.zeros((steps, self._model.nu), bool)
        for command in self._commands:
            command.drive(time, driven)
        controls = np.tile(np.where(driven, 0.0, self._idle), (len(values), 1, 1))
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


def _measure_rests(model: mujoco.MjModel) -> None:
    """Springs of tendons that nobody gave a rest: it is their length in the scene as it is tuned.

    `mj_setConst` did that until MuJoCo 3.16.
    """
    open_ = (model.tendon_lengthspring == -1).all(axis=1)
    if open_.any():
        drawn = mujoco.MjData(model)
        drawn.qpos[:] = model.qpos_spring
        mujoco.mj_fwdPosition(model, drawn)
        model.tendon_lengthspring[open_] = drawn.ten_length[open_, None]


def _starts(cell: Cell, model: mujoco.MjModel) -> dict[str, Start]:
    """First states by object, in the order of the inputs."""
    out, column = {}, len(cell.action)
    for spec in cell.starts:
        signal = cell.signal(spec.object)
        out[signal.name] = Start(model, signal, column, str(cell.path))
        column += len(input_names(spec, signal))
    return out


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

"""Batched rollouts of a cell with effects: parameters, actions and times in, what the tracker would say out."""

from __future__ import annotations

import copy
import os
from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from mujoco.rollout import Rollout

from compass_ros.cells import Cell
from compass_ros.cells.dynamics import Dynamics
from compass_ros.cells.registry import dynamics_of
from compass_ros.simulation.effects.attached import Attached
from compass_ros.simulation.effects.effect import Context, Sample, restore
from compass_ros.simulation.native.program import Kind, Programs, Term
from compass_ros.types import QUANTITY_SIZE, Floats, Ints, Parameter

CHUNK = 128
"""Rollouts held in memory at once; 128 of 2.5 s at 1 ms take 45 MB."""

_STATE = mujoco.mjtState.mjSTATE_FULLPHYSICS.value


@dataclass(frozen=True)
class Motion:
    """What was simulated: (B, T + 1) times are `time_step * arange`; row 0 is the start."""

    time_step: float
    positions: Floats
    """(B, T + 1, C) observed columns before any effect of the sensor."""


class Simulator:
    """Rolls out a cell with attached effects on all cores.

    The parameter vector is the cell's parameters followed by the quantities of each attached effect. The same values
    give the same bits whatever the number of threads: each rollout has a model of its own and starts from a cleared
    state. Raises ConfigError where an effect cannot act on the scene.
    """

    def __init__(self, cell: Cell, effects: Sequence[Attached] = (), threads: int = 0) -> None:
        self.cell = cell
        self.effects = tuple(effects)
        self.threads = threads or len(os.sched_getaffinity(0))
        self._dynamics: Dynamics = dynamics_of(cell)
        self._model = self._dynamics.model
        self._models = [copy.copy(self._model)]
        self._data = [mujoco.MjData(self._model) for _ in range(self.threads)]
        self._pool = Rollout(nthread=self.threads)
        self._scratch = mujoco.MjData(self._model)
        for attached in self.effects:
            attached.check(self._model)
        self.rollouts = 0
        self.simulated_seconds = 0.0

    def with_effects(self, effects: Sequence[Attached]) -> Simulator:
        """The same cell with other effects."""
        return Simulator(self.cell, effects, self.threads)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The cell's parameters, then the quantities of each effect as `objects@effect@quantity`."""
        return self.cell.parameters + tuple(p for attached in self.effects for p in attached.parameters())

    @property
    def defaults(self) -> Floats:
        """(P,) defaults of the cell; effects absent."""
        return np.array([p.default for p in self.parameters])

    @property
    def time_step(self) -> float:
        return float(self._model.opt.timestep)

    def motion(self, values: Floats, inputs: Floats, duration: float) -> Motion:
        """Roll out (B, P) values with (B, A) inputs for `duration` seconds."""
        parts = [
            self._chunk(values[i : i + CHUNK], inputs[i : i + CHUNK], duration) for i in range(0, len(values), CHUNK)
        ]
        return Motion(self.time_step, np.concatenate(parts))

    def observe(self, values: Floats, inputs: Floats, time_s: Floats) -> Floats:
        """(B, F, C) what the tracker says at (B, F) times [s] since the command; (B, P) values, (B, A) inputs."""
        parts = [
            self._observe_chunk(values[i : i + CHUNK], inputs[i : i + CHUNK], time_s[i : i + CHUNK])
            for i in range(0, len(values), CHUNK)
        ]
        return np.concatenate(parts)

    def bodies(self, values: Floats, action: Floats, time_s: Floats) -> dict[str, Floats]:
        """(F, 3) x, y [m], yaw [rad] of each moving body of a planar cell as the camera sees it; for drawings."""
        duration = float(np.max(time_s))
        states = self._roll(values[None], action[None], duration, np.arange(self._model.nq))
        positions = _interpolate(states, self.time_step, time_s[None])
        poses = self._dynamics.poses(self._of_cell(values[None]), positions)
        return {name: pose[0] for name, pose in poses.items()}

    def _observe_chunk(self, values: Floats, inputs: Floats, time_s: Floats) -> Floats:
        last = float(np.nanmax(time_s))
        ahead = sum(a.effect.ahead(numbers, last) for a, numbers in self._split(values) if a.effect.ahead is not None)
        duration = float(np.nanmax(self.cell.simulated_time(inputs, time_s))) + ahead
        positions = self._chunk(values, inputs, duration)

        def perfect(time: Floats) -> Floats:
            return _interpolate(positions, self.time_step, self.cell.simulated_time(inputs, time))

        sample: Sample = perfect
        for attached, numbers in self._split(values):
            if attached.effect.sensing is not None:
                sample = attached.effect.sensing(sample, numbers, self._context(attached, values))
        return np.asarray(sample(time_s))

    def _chunk(self, values: Floats, inputs: Floats, duration: float) -> Floats:
        return self._dynamics.observe(
            self._of_cell(values), self._roll(values, inputs, duration, self._dynamics.columns())
        )

    def _roll(self, values: Floats, inputs: Floats, duration: float, columns: Ints) -> Floats:
        """(B, T + 1, n) the given places of (qpos, qvel, act, sensordata), the start first."""
        batch, steps = len(values), max(int(np.ceil(duration / self.time_step)), 1)
        steps += bool(self._model.nsensordata)  # sensors speak of the state before a step
        while len(self._models) < batch:
            self._models.append(copy.copy(self._model))
        models = self._models[:batch]
        self._write(models, values)
        start = np.zeros((batch, mujoco.mj_stateSize(self._model, _STATE)))
        nq, nv = self._model.nq, self._model.nv
        start[:, 1 : 1 + nq], start[:, 1 + nq : 1 + nq + nv] = self._dynamics.start(self._of_cell(values), inputs)
        controls = self._controls(values, inputs, steps) if self._model.nu else None
        with Programs(models, self._terms(values)):
            states, sensors = self._pool.rollout(models, self._data, start, controls, nstep=steps)
        self.rollouts += batch
        self.simulated_seconds += batch * steps * self.time_step
        if self._model.nsensordata:
            rows = np.concatenate([start[:, None], states[:, :-1]], axis=1)
            return np.asarray(np.concatenate([rows, sensors], axis=2)[:, :, 1 + columns])
        return np.concatenate([start[:, None, 1 + columns], states[:, :, 1 + columns]], axis=1)

    def _controls(self, values: Floats, inputs: Floats, steps: int) -> Floats:
        controls = self._dynamics.controls(self._of_cell(values), inputs, steps)
        for attached, numbers in self._split(values):
            if attached.effect.controls is not None:
                controls = attached.effect.controls(controls, numbers, self._context(attached, values))
        return np.ascontiguousarray(controls)

    def _write(self, models: Sequence[mujoco.MjModel], values: Floats) -> None:
        """Parameters and effects into the models, then what MuJoCo derives from them."""
        for model in models:
            restore(model, self._model)
        self._dynamics.apply(models, self._of_cell(values))
        for attached, numbers in self._split(values):
            if attached.effect.model is not None:
                context = self._context(attached, values)
                for model, of_rollout in zip(models, numbers, strict=True):
                    attached.effect.model(model, of_rollout, context)
        for model in models:
            mujoco.mj_setConst(model, self._scratch)

    def _terms(self, values: Floats) -> list[Term]:
        terms = [
            Term(Kind.TABLE_FRICTION, s.body, np.stack([s.friction, s.creep, s.load], axis=1))
            for s in self._dynamics.sliding(self._of_cell(values))
        ]
        for attached, numbers in self._split(values):
            if attached.effect.forces is not None and attached.present(numbers):
                terms.extend(attached.effect.forces(numbers, self._context(attached, values)))
        return terms

    def _of_cell(self, values: Floats) -> Floats:
        """The part of (B, P) values that the cell knows."""
        return values[:, : len(self.cell.parameters)]

    def _split(self, values: Floats) -> list[tuple[Attached, Floats]]:
        """Each effect with its (B, q) part of the values."""
        out, at = [], len(self.cell.parameters)
        for attached in self.effects:
            size = len(attached.effect.quantities)
            out.append((attached, values[:, at : at + size]))
            at += size
        return out

    def _context(self, attached: Attached, values: Floats) -> Context:
        planes: list[tuple[int, int]] = []
        positions: list[int] = []
        column = 0
        for spec in self.cell.objects:
            size = QUANTITY_SIZE[spec.quantity]
            positions.extend(range(column, column + min(size, 3)))
            if spec.quantity != "joint":
                planes.append((column, column + 1))
            column += size
        sliding = {s.body: s for s in self._dynamics.sliding(self._of_cell(values))}
        return Context(attached.objects, sliding, tuple(planes), tuple(positions), self.time_step)


def _interpolate(positions: Floats, time_step: float, time_s: Floats) -> Floats:
    """(B, F, C) linear interpolation of (B, T, C) rows at (B, F) times; before the start and after the end it holds."""
    at = np.clip(np.nan_to_num(time_s) / time_step, 0, positions.shape[1] - 1)
    low = np.minimum(at.astype(int), positions.shape[1] - 2)
    share = (at - low)[:, :, None]
    rows = np.arange(len(positions))[:, None]
    return np.asarray((1 - share) * positions[rows, low] + share * positions[rows, low + 1])

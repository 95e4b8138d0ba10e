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
from compass_ros.simulation.effects.effect import Context, Sample
from compass_ros.simulation.native.program import Kind, Programs, Term
from compass_ros.types import QUANTITY_SIZE, Floats, Parameter

CHUNK = 128
"""Rollouts held in memory at once; 128 of 2.5 s at 1 ms take 45 MB."""

_STATE = mujoco.mjtState.mjSTATE_FULLPHYSICS.value
RESTORED = ("geom_pos", "geom_quat", "body_ipos", "pair_solref", "geom_solref")
"""Fields that effects may change; copied back from the scene before each rollout."""


@dataclass(frozen=True)
class Motion:
    """What was simulated: (B, T + 1) times are `time_step * arange`; row 0 is the start."""

    time_step: float
    positions: Floats
    """(B, T + 1, C) observed columns before any effect of the sensor."""


class Simulator:
    """Rolls out a cell with attached effects on all cores.

    The parameter vector is the cell's parameters followed by the quantities of each attached effect. The same values give
    the same bits whatever the number of threads: each rollout has a model of its own and starts from a cleared state.
    """

    def __init__(self, cell: Cell, effects: Sequence[Attached] = (), threads: int = 0) -> None:
        self.cell = cell
        self.effects = tuple(effects)
        self.threads = threads or os.cpu_count() or 1
        self._dynamics: Dynamics = dynamics_of(cell)
        self._model = self._dynamics.model
        self._models = [copy.copy(self._model)]
        self._data = [mujoco.MjData(self._model) for _ in range(self.threads)]
        self._pool = Rollout(nthread=self.threads)
        self._columns = self._dynamics.columns()
        self.rollouts = 0
        self.simulated_seconds = 0.0

    def with_effects(self, effects: Sequence[Attached]) -> Simulator:
        """The same cell with other effects."""
        return Simulator(self.cell, effects, self.threads)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The cell's parameters, then the quantities of each effect as `effect@effect@quantity`."""
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
        """(B, F, C) what the tracker would say at (B, F) times since the command, for (B, P) values and (B, A) inputs."""
        parts = [
            self._observe_chunk(values[i : i + CHUNK], inputs[i : i + CHUNK], time_s[i : i + CHUNK])
            for i in range(0, len(values), CHUNK)
        ]
        return np.concatenate(parts)

    def bodies(self, values: Floats, action: Floats, time_s: Floats) -> dict[str, Floats]:
        """(F, 3) x, y [m], yaw [rad] of each moving body of a planar cell, seen by the tracker's frame (for drawing)."""
        states = self._states(values[None], action[None], float(time_s.max()))
        positions = _interpolate(states[:, :, 1 : 1 + self._model.nq], self.time_step, time_s[None])[0]
        names = [self._model.joint(i).name for i in range(self._model.njnt)]
        seen = self.observe(values[None], action[None], time_s[None])[0]
        offset = seen[0, :2] - positions[0, self._columns[:2]] - self._rest(self.cell.objects[0].name)
        out: dict[str, Floats] = {}
        for body in sorted({name.rsplit("_", 1)[0] for name in names}):
            parts = [
                positions[:, names.index(f"{body}_{a}")] if f"{body}_{a}" in names else 0 * time_s
                for a in ("x", "y", "yaw")
            ]
            out[body] = np.stack(parts, axis=1)
            out[body][:, :2] += self._rest(body) + offset
        return out

    def _rest(self, body: str) -> Floats:
        return np.asarray(self._model.body(body).pos[:2])

    def _observe_chunk(self, values: Floats, inputs: Floats, time_s: Floats) -> Floats:
        positions = self._chunk(values, inputs, float(np.nanmax(time_s)) + self._margin(values))

        def perfect(time: Floats) -> Floats:
            return _interpolate(positions, self.time_step, time)

        sample: Sample = perfect
        for attached, numbers in self._split(values):
            if attached.effect.sensing is not None:
                sample = attached.effect.sensing(sample, numbers, self._context(attached, values))
        return sample(time_s)

    def _chunk(self, values: Floats, inputs: Floats, duration: float) -> Floats:
        states = self._states(values, inputs, duration)
        return self._dynamics.observe(values[:, : len(self.cell.parameters)], states[:, :, 1 + self._columns])

    def _states(self, values: Floats, inputs: Floats, duration: float) -> Floats:
        """(B, T + 1, nstate) full physics states, the start first."""
        batch, steps = len(values), max(int(np.ceil(duration / self.time_step)), 1)
        cell_values = values[:, : len(self.cell.parameters)]
        while len(self._models) < batch:
            self._models.append(copy.copy(self._model))
        models = self._models[:batch]
        self._write(models, cell_values, values)
        positions, velocities = self._dynamics.start(cell_values, inputs)
        start = np.zeros((batch, mujoco.mj_stateSize(self._model, _STATE)))
        start[:, 1 : 1 + self._model.nq] = positions
        start[:, 1 + self._model.nq : 1 + self._model.nq + self._model.nv] = velocities
        controls = self._dynamics.controls(cell_values, inputs, steps)
        for attached, numbers in self._split(values):
            if attached.effect.controls is not None:
                controls = attached.effect.controls(controls, numbers, self._context(attached, values))
        with Programs(models, self._terms(values)):
            states, _ = self._pool.rollout(
                models, self._data, start, np.ascontiguousarray(controls) if self._model.nu else None, nstep=steps
            )
        self.rollouts += batch
        self.simulated_seconds += batch * steps * self.time_step
        return np.concatenate([start[:, None], states], axis=1)

    def _write(self, models: Sequence[mujoco.MjModel], cell_values: Floats, values: Floats) -> None:
        for model in models:
            model.opt.cone = self._model.opt.cone
            for field in RESTORED:
                getattr(model, field)[:] = getattr(self._model, field)
        self._dynamics.apply(models, cell_values)
        for attached, numbers in self._split(values):
            if attached.effect.model is not None:
                for model, of_rollout in zip(models, numbers, strict=True):
                    if of_rollout.any():
                        attached.effect.model(model, of_rollout, self._context(attached, values))

    def _terms(self, values: Floats) -> list[Term]:
        terms = [
            Term(Kind.TABLE_FRICTION, s.body, np.stack([s.friction, s.creep, s.load], axis=1))
            for s in self._dynamics.sliding(values[:, : len(self.cell.parameters)])
        ]
        for attached, numbers in self._split(values):
            if attached.effect.forces is not None and attached.present(numbers):
                terms.extend(attached.effect.forces(numbers, self._context(attached, values)))
        return terms

    def _split(self, values: Floats) -> list[tuple[Attached, Floats]]:
        """Each effect with its (B, q) part of the values."""
        out, at = [], len(self.cell.parameters)
        for attached in self.effects:
            size = len(attached.effect.quantities)
            out.append((attached, values[:, at : at + size]))
            at += size
        return out

    def _context(self, attached: Attached, values: Floats) -> Context:
        planes, positions, column = [], [], 0
        for spec in self.cell.objects:
            size = QUANTITY_SIZE[spec.quantity]
            positions.extend(range(column, column + min(size, 3)))
            if spec.quantity != "joint":
                planes.append((column, column + 1))
            column += size
        sliding = self._dynamics.sliding(values[:, : len(self.cell.parameters)])
        return Context(attached.objects, {s.body: s for s in sliding}, tuple(planes), tuple(positions), self.time_step)

    def _margin(self, values: Floats) -> float:
        """Seconds that a sensing effect may look beyond the last frame."""
        return 0.1 if any(a.effect.sensing is not None for a in self.effects) else 0.0


def _interpolate(positions: Floats, time_step: float, time_s: Floats) -> Floats:
    """(B, F, C) linear interpolation of (B, T, C) rows at (B, F) times; before the start and after the end it holds."""
    at = np.clip(np.nan_to_num(time_s) / time_step, 0, positions.shape[1] - 1)
    low = np.minimum(at.astype(int), positions.shape[1] - 2)
    share = (at - low)[:, :, None]
    rows = np.arange(len(positions))[:, None]
    return np.asarray((1 - share) * positions[rows, low] + share * positions[rows, low + 1])

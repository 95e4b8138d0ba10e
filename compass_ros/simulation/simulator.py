"""Batched rollouts of a cell with effects: parameters, actions and times in, what the tracker would say out."""

from __future__ import annotations

import copy
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from mujoco.rollout import Rollout

from compass_ros.cells import Cell
from compass_ros.cells.dynamics import Dynamics
from compass_ros.cells.registry import dynamics_of
from compass_ros.errors import ConfigError
from compass_ros.simulation.alike import roll_alike
from compass_ros.simulation.effects.attached import Attached
from compass_ros.simulation.effects.effect import Context, Effect, Sample, restore
from compass_ros.simulation.native.program import (
    Kind,
    Programs,
    Term,
    evaluate,
    mover_masses,
    path_columns,
    slides_or_turns,
)
from compass_ros.types import QUANTITY_SIZE, Floats, Ints, Parameter, Unit

CHUNK = 128
"""Rollouts held in memory at once; 128 of 2.5 s at 1 ms take 45 MB."""

TOGETHER = 512
"""Rollouts that branch off others, with those: their states are held in memory too."""

_STATE = mujoco.mjtState.mjSTATE_FULLPHYSICS.value


@dataclass(frozen=True)
class Motion:
    """What was simulated: (B, T + 1) times are `time_step * arange`; row 0 is the start."""

    time_step: float
    positions: Floats
    """(B, T + 1, C) observed columns before any effect of the sensor."""


@dataclass
class Spent:
    """What rollouts have cost."""

    rollouts: int = 0
    seconds: float = 0.0


class Simulator:
    """Rolls out a cell with attached effects on all cores.

    The parameter vector is the cell's parameters followed by the quantities of each attached effect. The same values
    give the same bits whatever the number of threads: each rollout has a model of its own and starts from a cleared
    state. Raises ConfigError where an effect cannot act on the scene.
    """

    def __init__(
        self, cell: Cell, effects: Sequence[Attached] = (), threads: int = 0, options: Mapping[str, float] | None = None
    ) -> None:
        """`options`: MuJoCo's numerics (`timestep`, `cone`, `solver`, ...) where they are not to be the scene's."""
        self.cell = cell
        self.effects = tuple(effects)
        self.threads = threads or len(os.sched_getaffinity(0))
        self._dynamics: Dynamics = dynamics_of(cell)
        self._model = self._dynamics.model
        for name, value in (options or {}).items():
            setattr(self._model.opt, name, value)
        self._models = [copy.copy(self._model)]
        self._data = [mujoco.MjData(self._model) for _ in range(self.threads)]
        self._pool = Rollout(nthread=self.threads)
        self._scratch = mujoco.MjData(self._model)
        for attached in self.effects:
            attached.check(self._model)
        self._spent = Spent()

    @property
    def rollouts(self) -> int:
        """Rollouts so far, of this simulator and of all that share its cell (`with_effects`)."""
        return self._spent.rollouts

    @property
    def simulated_seconds(self) -> float:
        """The same in simulated time."""
        return self._spent.seconds

    def with_effects(self, effects: Sequence[Attached]) -> Simulator:
        """The same cell with other effects. Shares threads, models and counters with this one: use one at a time."""
        other = copy.copy(self)
        other.effects = tuple(effects)
        for attached in other.effects:
            attached.check(self._model)
        return other

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

    @property
    def options(self) -> mujoco.MjOption:
        """MuJoCo's numerics of this simulator; not to be changed."""
        return self._model.opt

    @property
    def actuated(self) -> bool:
        """Whether the cell moves anything by commands."""
        return bool(self._model.nu)

    @property
    def unit(self) -> Unit:
        """Of a distance between two states: rad where all that is tracked are hinges."""
        tracked = [spec.body or spec.name for spec in self.cell.objects if spec.quantity == "joint"]
        hinges = [name for name in tracked if self._model.joint(name).type[0] == mujoco.mjtJoint.mjJNT_HINGE]
        return "rad" if len(hinges) == len(self.cell.objects) else "m"

    def movers(self) -> tuple[str, ...]:
        """Tracked bodies that slide in the plane and tracked joints: what a force along the way can act on."""
        names = [spec.body or spec.name for spec in self.cell.objects]
        return tuple(name for name in names if slides_or_turns(self._model, name))

    def walls(self) -> tuple[str, ...]:
        """Fixed geoms that a tracked body can touch."""
        pairs = [(self._model.pair_geom1[i], self._model.pair_geom2[i]) for i in range(self._model.npair)]
        fixed = {int(g) for pair in pairs for g in pair if self._model.body_weldid[self._model.geom_bodyid[g]] == 0}
        return tuple(self._model.geom(g).name for g in sorted(fixed) if self._model.geom(g).name)

    def accepts(self, effect: Effect, objects: Sequence[str]) -> bool:
        """Whether an effect can act on these objects here."""
        values = self.defaults[None]
        trial = Attached(effect, tuple(objects))
        try:
            trial.check(self._model)
            if effect.forces is not None:
                effect.forces(np.array([[q.start or q.scale for q in effect.quantities]]), self._context(trial, values))
            if effect.model is not None:
                sizes = np.array([q.scale for q in effect.quantities])
                effect.model(copy.copy(self._model), sizes, self._context(trial, values))
        except ConfigError:
            return False
        return True

    def masses(self, values: Floats, names: Sequence[str]) -> Floats:
        """(N,) mass of each mover at (P,) values [kg]; 1 for joints, on which forces are torques."""
        self._write(self._models[:1], values[None])
        return mover_masses(self._models[0], names)

    def forces(self, attached: Attached, numbers: Floats, values: Floats, states: Floats) -> dict[str, Floats]:
        """(B, F, 2) force of an effect on each mover in given states.

        (B, q) numbers, (P,) values of the cell, (B, F, N, 6) states x, y, vx, vy, mass, time of the effect's N objects.
        """
        tiled = np.tile(values, (len(numbers), 1))
        terms = attached.effect.forces(numbers, self._context(attached, tiled)) if attached.effect.forces else ()
        gravity = -float(self._model.opt.gravity[2])
        out = {name: np.zeros((*states.shape[:2], 2)) for name in attached.objects}
        for term in terms:
            out[term.object] += evaluate(term, states[:, :, attached.objects.index(term.object)], gravity)
        return out

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

    def observe_alike(
        self, values: Floats, inputs: Floats, time_s: Floats, like: Ints, until: Floats
    ) -> tuple[Floats, Floats]:
        """The same for rows that move as row like[b] up to simulated time until[b] [s], without simulating that again.

        (B,) like: a row that others are like is like itself. Returned is also up to when each row really was as its
        other one, by comparison of all states; a row whose `until` is seen to be too late is simulated as a whole.
        Where MuJoCo has sensors everything is simulated.
        """
        observed, same = np.empty(0), np.zeros(len(values))
        if self._model.nsensordata:
            return self.observe(values, inputs, time_s), same
        models, of = np.unique(like, return_inverse=True)
        size = max(TOGETHER // max(int(np.bincount(of).max()), 1), 1)
        for i in range(0, len(models), size):
            rows = np.flatnonzero((of >= i) & (of < i + size))
            there = np.searchsorted(rows, like[rows])
            part, same[rows] = self._observe_together(values[rows], inputs[rows], time_s[rows], there, until[rows])
            if not observed.size:
                observed = np.empty((len(values), *part.shape[1:]))
            observed[rows] = part
        return observed, same

    def bodies(self, values: Floats, action: Floats, time_s: Floats) -> dict[str, Floats]:
        """(F, 3) x, y [m], yaw [rad] of each moving body of a planar cell as the camera sees it; for drawings."""
        duration = float(np.max(time_s))
        states = self._roll(values[None], action[None], duration, np.arange(self._model.nq))
        positions = _interpolate(states, self.time_step, time_s[None])
        poses = self._dynamics.poses(self._of_cell(values[None]), positions)
        return {name: pose[0] for name, pose in poses.items()}

    def paths(self, values: Floats, inputs: Floats, time_s: Floats, names: Sequence[str]) -> Floats:
        """(B, F, N, 4) x, y [m], vx, vy [m/s] in the world of N bodies on the table; joints: angle, 0, rate, 0."""
        columns: list[int] = []
        rest: list[tuple[float, float, float, float]] = []
        for name in names:
            own, offset = path_columns(self._model, name)
            columns.extend(own)
            rest.append(offset)
        states = self._roll(values, inputs, float(np.max(time_s)), np.maximum(columns, 0))
        rows = _interpolate(states, self.time_step, np.broadcast_to(time_s, (len(values), time_s.shape[-1])))
        rows = np.where(np.array(columns) >= 0, rows, 0.0).reshape(*rows.shape[:2], len(names), 4)
        return np.asarray(rows + np.array(rest))

    def _observe_together(
        self, values: Floats, inputs: Floats, time_s: Floats, like: Ints, until: Floats
    ) -> tuple[Floats, Floats]:
        """As `observe_alike`. Where start or commands differ, rows differ from there on, whatever was said."""
        steps = self._steps(self._duration(values, inputs, time_s))
        start, controls = self._begin(values, inputs, steps)
        known = np.minimum(until / self.time_step, steps).astype(int)
        if controls is not None:
            commanded = (controls != controls[like]).any(axis=2)
            known = np.minimum(known, np.where(commanded.any(axis=1), commanded.argmax(axis=1), steps))
        known[(start != start[like]).any(axis=1)] = 0

        def play(rows: Ints, begin: Floats, step: int) -> Floats:
            return self._play(values[rows], begin, None if controls is None else controls[rows, step:], steps - step)[0]

        columns = 1 + self._dynamics.columns()
        states, same = roll_alike(play, start, steps, columns, like, known, CHUNK)
        positions = self._dynamics.observe(self._of_cell(values), states)
        return self._sensed(values, inputs, time_s, positions), same * self.time_step

    def _observe_chunk(self, values: Floats, inputs: Floats, time_s: Floats) -> Floats:
        positions = self._chunk(values, inputs, self._duration(values, inputs, time_s))
        return self._sensed(values, inputs, time_s, positions)

    def _duration(self, values: Floats, inputs: Floats, time_s: Floats) -> float:
        """How long to simulate for what is asked [s]."""
        last = float(np.nanmax(time_s))
        ahead = sum(a.effect.ahead(numbers, last) for a, numbers in self._split(values) if a.effect.ahead is not None)
        return float(np.nanmax(self.cell.simulated_time(inputs, time_s))) + ahead

    def _sensed(self, values: Floats, inputs: Floats, time_s: Floats, positions: Floats) -> Floats:
        """(B, F, C) what the tracker says of (B, T + 1, C) positions."""

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
        steps = self._steps(duration)
        start, controls = self._begin(values, inputs, steps)
        states, sensors = self._play(values, start, controls, steps)
        if self._model.nsensordata:
            rows = np.concatenate([start[:, None], states[:, :-1]], axis=1)
            return np.asarray(np.concatenate([rows, sensors], axis=2)[:, :, 1 + columns])
        return np.concatenate([start[:, None, 1 + columns], states[:, :, 1 + columns]], axis=1)

    def _steps(self, duration: float) -> int:
        steps = max(int(np.ceil(duration / self.time_step)), 1)
        return steps + bool(self._model.nsensordata)  # sensors speak of the state before a step

    def _begin(self, values: Floats, inputs: Floats, steps: int) -> tuple[Floats, Floats | None]:
        """(B, s) states at simulated time 0 and (B, T, nu) controls."""
        start = np.zeros((len(values), mujoco.mj_stateSize(self._model, _STATE)))
        nq, nv = self._model.nq, self._model.nv
        start[:, 1 : 1 + nq], start[:, 1 + nq : 1 + nq + nv] = self._dynamics.start(self._of_cell(values), inputs)
        return start, self._controls(values, inputs, steps) if self._model.nu else None

    def _play(self, values: Floats, start: Floats, controls: Floats | None, steps: int) -> tuple[Floats, Floats]:
        """(B, T, s) states and (B, T, nsensordata) sensors from (B, s) states on."""
        batch = len(values)
        while len(self._models) < batch:
            self._models.append(copy.copy(self._model))
        models = self._models[:batch]
        self._write(models, values)
        with Programs(models, self._terms(values)):
            states, sensors = self._pool.rollout(models, self._data, start, controls, nstep=steps)
        self._spent.rollouts += batch
        self._spent.seconds += batch * steps * self.time_step
        return states, sensors

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

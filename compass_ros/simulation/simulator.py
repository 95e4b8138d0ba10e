"""Batched rollouts of a cell with effects: parameters, actions and times in, what the tracker would say out."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import mujoco
import numpy as np

from compass_ros.cells import Cell
from compass_ros.cells.cell import Beside
from compass_ros.cells.drives import Drive, Drives, span
from compass_ros.cells.registry import dynamics_of
from compass_ros.cells.sensors import units_of
from compass_ros.cells.signals import Signal
from compass_ros.simulation.alike import roll_alike
from compass_ros.simulation.effects.attached import Attached
from compass_ros.simulation.effects.effect import Effect
from compass_ros.simulation.native.program import evaluate, path_columns
from compass_ros.simulation.numerics import set_numerics
from compass_ros.simulation.physics import Physics, interpolate, places_of
from compass_ros.simulation.player import Player
from compass_ros.simulation.rotors import relax
from compass_ros.simulation.sites import Places, Site
from compass_ros.types import Floats, Ints, Parameter, Unit

CHUNK = 128
"""Rollouts held in memory at once; 128 of 2.5 s at 1 ms take 45 MB."""

TOGETHER = 512
"""Rollouts that branch off others, with those: their states are held in memory too."""


@dataclass(frozen=True)
class Motion:
    """What was simulated: (B, T + 1) times are `time_step * arange`; row 0 is the start."""

    time_step: float
    positions: Floats
    """(B, T + 1, C) observed columns before any effect of the sensor."""


def in_chunks(of: Callable[..., Floats], *rows: Floats) -> Floats:
    """A function of rows that belong together, CHUNK of them at a time: each rollout needs a model of its own."""
    parts = [of(*(r[i : i + CHUNK] for r in rows)) for i in range(0, len(rows[0]), CHUNK)]
    return np.concatenate(parts)


def with_rotors(cell: Cell, effects: Sequence[Attached]) -> Cell:
    """The cell whose scene has the rotors and anchors that effects act on, and no others."""
    rotors = dict.fromkeys(n for a in effects if a.effect.rotor for n in a.objects)
    anchors = dict.fromkeys(n for a in effects if a.effect.anchored for n in a.objects)
    return replace(cell, rotors=tuple(rotors), anchors=tuple(anchors))


class Simulator:
    """Rolls out a cell with attached effects on all cores.

    The parameter vector is the cell's parameters followed by the quantities of each attached effect. The same values
    give the same bits whatever the number of threads: each rollout has a model of its own and starts from a cleared
    state. Raises ConfigError where an effect cannot act on the scene.
    """

    def __init__(
        self, cell: Cell, effects: Sequence[Attached] = (), threads: int = 0,
        options: Mapping[str, float] | None = None, softness: Mapping[str, float] | None = None,
    ) -> None:  # fmt: skip
        """`options`: MuJoCo's numerics (`timestep`, `cone`, `solver`, ...) where they are not to be the scene's.
        `softness`: what is left of the regularisation of joints' dry friction, or of contacts (`set_numerics`)."""
        of_cell = {} if cell.time_step is None else {"timestep": cell.time_step}
        told = {**of_cell, **(options or {})}
        self._numerics = partial(set_numerics, options=told, softness=softness or {}, holds=cell.holds)
        dynamics = dynamics_of(cell)
        self._numerics(dynamics.model)
        drives = Drives(cell, dynamics.model)
        self.physics = Physics(cell, dynamics, places_of(cell, dynamics, drives), (), drives)
        self._players: dict[Beside, Player] = {((), ()): Player(dynamics.model, threads)}
        self.physics = self._taking(effects)

    @property
    def cell(self) -> Cell:
        return self.physics.cell

    @property
    def effects(self) -> tuple[Attached, ...]:
        return self.physics.effects

    @property
    def threads(self) -> int:
        return self._players[(), ()].threads

    @property
    def rollouts(self) -> int:
        """Rollouts so far, of this simulator and of all that share its cell (`with_effects`)."""
        return self._player.spent.rollouts

    @property
    def simulated_seconds(self) -> float:
        """The same in simulated time."""
        return self._player.spent.simulated_seconds

    @property
    def warnings(self) -> tuple[str, ...]:
        """What MuJoCo has warned of in these rollouts: one line, or none."""
        return self._player.warned.said(self.rollouts)

    def with_effects(self, effects: Sequence[Attached]) -> Simulator:
        """The same cell with other effects. Shares threads, models and counters with this one: use one at a time."""
        other = copy.copy(self)
        other.physics = self._taking(effects)
        return other

    def _taking(self, effects: Sequence[Attached]) -> Physics:
        """The physics with these effects, of the scene with the rotors that they act on."""
        physics, cell = replace(self.physics, effects=tuple(effects)), with_rotors(self.cell, effects)
        if cell.beside == self.cell.beside:
            return physics
        dynamics = dynamics_of(cell)
        self._numerics(dynamics.model)
        return replace(physics, cell=cell, dynamics=dynamics, drives=Drives(cell, dynamics.model))

    @property
    def _player(self) -> Player:
        """Of the scene with these rotors and anchors. That without any is kept, and the last one with some."""
        beside = self.cell.beside
        if beside not in self._players:
            plain = self._players[(), ()]
            self._players.clear()
            self._players.update({((), ()): plain, beside: Player(self.physics.model, plain.threads, like=plain)})
        return self._players[beside]

    def driven(self, bank: Sequence[Drive]) -> Simulator:
        """The same with recorded inputs, of which the input `window` names one. Shares what `with_effects` shares."""
        other = copy.copy(self)
        other.physics = replace(self.physics, bank=tuple(bank))
        return other

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """The cell's parameters, then the quantities of each effect as `objects@effect@quantity`."""
        return self.physics.parameters

    @property
    def defaults(self) -> Floats:
        """(P,) defaults of the cell; effects absent."""
        return np.array([p.default for p in self.parameters])

    def inputs(self, commanded: Floats) -> Floats:
        """(E, A) inputs of the cell, then a column of zeros for each number that an episode has of its own."""
        return np.pad(commanded, ((0, 0), (0, sum(a.drawn for a in self.effects))))

    def launch_std(self, values: Floats, stated: Floats | None = None) -> Floats:
        """(A,) standard deviation of each of these inputs around what was commanded, at (P,) values.

        `stated`: what the recordings say (`Recordings.start_std`), beside the cell or where it leaves it to them.
        """
        own = [n[0] for a, n in self.physics.of_effects(values[None]) if a.drawn]
        of_cell, said = self.cell.launch_std, 0.0 if stated is None else stated
        beside = np.where(of_cell > 0, np.hypot(of_cell, said), of_cell)
        return np.concatenate([np.where(np.isnan(of_cell), said, beside), *own])

    @property
    def time_step(self) -> float:
        return self.physics.time_step

    @property
    def options(self) -> mujoco.MjOption:
        """MuJoCo's numerics of this simulator; not to be changed."""
        return self.physics.model.opt

    @property
    def actuated(self) -> bool:
        """Whether the cell moves anything by commands."""
        return bool(self.physics.model.nu)

    @property
    def unit(self) -> Unit:
        """Of a distance between two states: rad where all that is fitted are hinges. Of a pose its place counts."""
        found = {units[0] for s, units in self.units.items() if s.places and s.fitted}
        if "rad" not in found:
            return "m"
        return "rad and mm" if "m" in found else "rad"

    @property
    def units(self) -> dict[Signal, tuple[str, ...]]:
        """(D,) unit of each number of each signal."""
        return {s: units_of(self.physics.model, s, str(self.cell.path)) for s in self.cell.signals}

    @property
    def places(self) -> Places:
        """Where physics can act in the scene."""
        return self.physics.places

    def limits(self, actuators: Sequence[str]) -> Floats:
        """(N, 2) lowest and highest position of the joint that each actuator drives; infinite where it has none."""
        model = self.physics.model
        joints = [int(model.actuator(name).trnid[0]) for name in actuators]
        ranges = np.array([model.jnt_range[j] if model.jnt_limited[j] else (-np.inf, np.inf) for j in joints])
        return ranges.reshape(-1, 2)

    def movers(self) -> tuple[str, ...]:
        """Names of tracked bodies that slide in the plane and of tracked joints: what a force along the way acts on."""
        return tuple(self.moving)

    @cached_property
    def moving(self) -> Mapping[str, Site]:
        """The same as sites. A joint that is called as a tracked body is left out: what pushes the body pushes it."""
        tracked = [(name, signal.jointed) for signal in self.cell.signals if signal.places for name in signal.at]
        found: dict[str, Site] = {}
        for name, jointed in sorted(tracked, key=lambda one: one[1]):
            site = self.places.joint(name) if jointed else self.places.body(name)
            if site is not None and site.kind != "body":
                found.setdefault(name, site)
        return {name: found[name] for name in dict.fromkeys(name for name, _ in tracked) if name in found}

    @cached_property
    def in_space(self) -> Mapping[str, Site]:
        """Tracked bodies that move in space by themselves: none of their degrees of freedom is a tracked joint's."""
        model, joints = self.physics.model, set(self.moving)
        tracked = {name for signal in self.cell.signals if signal.places and not signal.jointed for name in signal.at}
        found: dict[str, Site] = {}
        for name in sorted(tracked):
            site = self.places.body(name)
            if site is None or site.kind != "body":
                continue
            body = model.body(name)
            own = range(int(body.jntadr[0]), int(body.jntadr[0]) + int(body.jntnum[0]))
            if own and not any(model.joint(i).name in joints for i in own):
                found[name] = site
        return found

    def accepts(self, effect: Effect, objects: Sequence[str]) -> bool:
        """Whether these objects are sites of a kind on which an effect can act."""
        return not Attached(effect, tuple(objects)).objection(self.places)

    def masses(self, values: Floats, names: Sequence[str]) -> Floats:
        """(N,) mass of each body in the plane at (P,) values [kg]."""
        model = self.written(values)
        return np.array([model.body_mass[model.body(name).id] for name in names])

    def forces(self, attached: Attached, numbers: Floats, values: Floats, states: Floats) -> dict[str, Floats]:
        """(B, F, 2) force of an effect on each mover in given states.

        (B, q) numbers, (P,) values of the cell, (B, F, N, 6) states x, y, vx, vy, mass, time of the effect's N objects.
        Of a joint: (angle, 0, rate, 0, anything, time), and its torque in the first place.
        """
        return self.force_law(attached, values, states)(numbers)

    def force_law(self, attached: Attached, values: Floats, states: Floats) -> Callable[[Floats], dict[str, Floats]]:
        """`forces` as a function of the numbers, for those who ask for many."""
        context = self.physics.context(attached.sites(self.places), np.tile(values, (len(states), 1)))
        gravity, forces = -float(self.physics.model.opt.gravity[2]), attached.effect.forces
        own = {name: np.ascontiguousarray(states[:, :, n]) for n, name in enumerate(attached.objects)}

        def at(numbers: Floats) -> dict[str, Floats]:
            out = {name: np.zeros((*states.shape[:2], 2)) for name in own}
            for term in forces(numbers, context) if forces else ():
                if term.site is not None:
                    out[term.site.name] += evaluate(term, own[term.site.name], gravity)
            return out

        return at

    def play(self, values: Floats, start: Floats, controls: Floats | None, steps: int) -> tuple[Floats, Floats]:
        """(B, T, s) full states and (B, T, nsensordata) sensors after each of T steps from (B, s) states."""
        return self._player.play(self.physics, values, start, controls, steps)

    def written(self, values: Floats) -> mujoco.MjModel:
        """The scene at (P,) values; it holds until the next rollout and is not to be changed."""
        return self._player.written(self.physics, values[None])[0]

    def begun(self, values: Floats, inputs: Floats, duration: float) -> tuple[Floats, Floats, Floats | None, int]:
        """What to play: (B, P) values with each rollout's own numbers of what differs by chance, (B, s) states at the
        start, (B, T, n) what drives MuJoCo for `duration` seconds, and T."""
        values = self.physics.own(values, inputs)
        start, steps = self.physics.start(values, inputs), self._steps(duration)
        if self.cell.anchors:
            relax(self.physics.model, start[:, 1 : 1 + self.physics.model.nq])
        if self.cell.rotors:
            self._player.carry(self.physics, values, start)
        return values, start, self.physics.controls(values, inputs, steps), steps

    def motion(self, values: Floats, inputs: Floats, duration: float) -> Motion:
        """Roll out (B, P) values with (B, A) inputs for `duration` seconds."""
        return Motion(self.time_step, in_chunks(lambda v, u: self._chunk(v, u, duration), values, inputs))

    def observe(self, values: Floats, inputs: Floats, time_s: Floats) -> Floats:
        """(B, F, C) what the tracker says at (B, F) times [s] since the command; (B, P) values, (B, A) inputs."""
        return in_chunks(self._observe_chunk, values, inputs, time_s)

    def observe_alike(
        self, values: Floats, inputs: Floats, time_s: Floats, like: Ints, until: Floats
    ) -> tuple[Floats, Floats]:
        """The same for rows that move as row like[b] up to simulated time until[b] [s], without simulating that again.

        (B,) like: a row that others are like is like itself. Returned is also up to when each row really was as its
        other one, by comparison of all states; a row whose `until` is seen to be too late is simulated as a whole.
        Where MuJoCo has sensors everything is simulated.
        """
        observed, same = np.empty(0), np.zeros(len(values))
        if self.physics.model.nsensordata:
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

    def states(self, values: Floats, inputs: Floats, duration: float) -> tuple[Floats, Floats]:
        """(B, T + 1, s) whole states (mjSTATE_FULLPHYSICS), the start first, and (B, T, n) what drives MuJoCo."""
        own, start, controls, steps = self.begun(values, inputs, duration)
        states = self.play(own, start, controls, steps)[0]
        driven = np.empty((len(values), steps, 0)) if controls is None else controls
        return np.concatenate([start[:, None], states], axis=1), driven

    def bodies(self, values: Floats, action: Floats, time_s: Floats) -> dict[str, Floats]:
        """(F, 3) x, y [m], yaw [rad] of each moving body of a planar cell as the camera sees it; for drawings."""
        duration = float(np.max(time_s))
        states = self._roll(values[None], action[None], duration, np.arange(self.physics.model.nq))
        positions = interpolate(states, self.time_step, time_s[None])
        poses = self.physics.dynamics.poses(self.physics.of_cell(values[None]), positions)
        return {name: pose[0] for name, pose in poses.items()}

    def paths(self, values: Floats, inputs: Floats, time_s: Floats, names: Sequence[str]) -> Floats:
        """(B, F, N, 4) x, y [m], vx, vy [m/s] in the world of N bodies on the table; joints: angle, 0, rate, 0."""
        columns: list[int] = []
        rest: list[tuple[float, float, float, float]] = []
        for name in names:
            own, offset = path_columns(self.physics.model, self.moving[name])
            columns.extend(own)
            rest.append(offset)
        states = self._roll(values, inputs, float(np.max(time_s)), np.maximum(columns, 0))
        rows = interpolate(states, self.time_step, np.broadcast_to(time_s, (len(values), time_s.shape[-1])))
        rows = np.where(np.array(columns) >= 0, rows, 0.0).reshape(*rows.shape[:2], len(names), 4)
        return np.asarray(rows + np.array(rest))

    def raw(self, values: Floats, inputs: Floats, time_s: Floats) -> Floats:
        """(B, T + 1, n) raw rows of the motion up to the last time asked for, of which `sensed` makes observations."""
        duration, columns = self.physics.duration(values, inputs, time_s), self.physics.dynamics.columns()
        return in_chunks(lambda v, u: self._roll(v, u, duration, columns), values, inputs)

    def sensed(self, values: Floats, inputs: Floats, time_s: Floats, raw: Floats) -> Floats:
        """As `observe`, of a motion that is known."""
        return self.physics.sensed(values, inputs, time_s, raw)

    def _observe_together(
        self, values: Floats, inputs: Floats, time_s: Floats, like: Ints, until: Floats
    ) -> tuple[Floats, Floats]:
        """As `observe_alike`. Where start or commands differ, rows differ from there on, whatever was said."""
        own, start, controls, steps = self.begun(values, inputs, self.physics.duration(values, inputs, time_s))
        known = np.minimum(until / self.time_step, steps).astype(int)
        if controls is not None:
            other = (controls != controls[like]).reshape(len(controls), -1)
            known = np.minimum(known, np.where(other.any(axis=1), other.argmax(axis=1) // controls.shape[2], steps))
        known[(start != start[like]).any(axis=1)] = 0

        def play(rows: Ints, begin: Floats, step: int) -> Floats:
            of_rows = None if controls is None else controls[rows, step:]
            return self.play(own[rows], begin, of_rows, steps - step)[0]

        columns = 1 + self.physics.dynamics.columns()
        states, same = roll_alike(play, start, steps, columns, like, known, CHUNK)
        return self.physics.sensed(values, inputs, time_s, states), same * self.time_step

    def _observe_chunk(self, values: Floats, inputs: Floats, time_s: Floats) -> Floats:
        duration = self.physics.duration(values, inputs, time_s)
        states = self._roll(values, inputs, duration, self.physics.dynamics.columns())
        return self.physics.sensed(values, inputs, time_s, states)

    def _chunk(self, values: Floats, inputs: Floats, duration: float) -> Floats:
        return self.physics.dynamics.observe(
            self.physics.of_cell(values), self._roll(values, inputs, duration, self.physics.dynamics.columns())
        )

    def _roll(self, values: Floats, inputs: Floats, duration: float, columns: Ints) -> Floats:
        """(B, T + 1, n) the given places of (qpos, qvel, act, sensordata), the start first."""
        own, start, controls, steps = self.begun(values, inputs, duration)
        states, sensors = self.play(own, start, controls, steps)
        places, size = 1 + columns, start.shape[1]
        if not self.physics.model.nsensordata:
            seen = np.empty((len(start), steps + 1, len(places)))
            seen[:, 0], seen[:, 1:] = start[:, places], states[:, :, span(places)]
            return seen
        seen, sensed = np.empty((len(start), steps, len(places))), places >= size
        seen[:, 0, ~sensed], seen[:, 1:, ~sensed] = start[:, places[~sensed]], states[:, :-1, span(places[~sensed])]
        seen[:, :, sensed] = sensors[:, :, span(places[sensed] - size)]
        return seen

    def _steps(self, duration: float) -> int:
        steps = max(int(np.ceil(duration / self.time_step)), 1)
        return steps + bool(self.physics.model.nsensordata)  # sensors speak of the state before a step

"""What a parameter vector means: the cell's values, then the quantities of each attached effect."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import mujoco
import numpy as np

from compass_ros.cells import Cell
from compass_ros.cells.drives import Drive, Drives
from compass_ros.cells.dynamics import Dynamics
from compass_ros.simulation.effects.attached import Attached
from compass_ros.simulation.effects.effect import Context, Sample, restore
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.types import Floats, Parameter


@dataclass(frozen=True)
class Physics:
    """A cell with effects, asked for B rollouts at once: (B, P) values, (B, A) inputs.

    The inputs may go on with one column for each scattered effect: the rollout's own number, instead of the value.
    Raises ConfigError where an effect acts on what the scene lacks.
    """

    cell: Cell
    dynamics: Dynamics
    effects: tuple[Attached, ...]
    drives: Drives
    bank: tuple[Drive, ...] = ()
    """Recorded inputs; the input `window` says which of them a rollout has."""

    def __post_init__(self) -> None:
        for attached in self.effects:
            attached.check(self.model)

    @property
    def model(self) -> mujoco.MjModel:
        """The scene at its defaults. Not to be changed."""
        return self.dynamics.model

    @property
    def time_step(self) -> float:
        return float(self.model.opt.timestep)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return self.cell.parameters + tuple(p for attached in self.effects for p in attached.parameters())

    def of_cell(self, values: Floats) -> Floats:
        """The part of the values that the cell knows."""
        return values[:, : len(self.cell.parameters)]

    def of_effects(self, values: Floats) -> list[tuple[Attached, Floats]]:
        """Each effect with its (B, q) part of the values."""
        out, at = [], len(self.cell.parameters)
        for attached in self.effects:
            size = len(attached.effect.quantities)
            out.append((attached, values[:, at : at + size]))
            at += size
        return out

    def of_command(self, inputs: Floats) -> Floats:
        """The part of the inputs that the cell knows."""
        return inputs[:, : len(self.cell.input_names)]

    def context(self, attached: Attached, values: Floats) -> Context:
        """What the hooks of an effect are told."""
        planes: list[tuple[int, int]] = []
        positions: list[int] = []
        for signal in self.cell.signals:
            if not signal.places:
                continue
            positions.extend(
                range(signal.first, signal.first + (signal.size if signal.jointed else min(signal.size, 3)))
            )
            if not signal.jointed:
                planes.append((signal.first, signal.first + 1))
        sliding = {s.body: s for s in self.dynamics.sliding(self.of_cell(values))}
        return Context(attached.objects, sliding, tuple(planes), tuple(positions), self.time_step)

    def write(self, models: Sequence[mujoco.MjModel], values: Floats) -> None:
        """Parameters and effects into B models. What MuJoCo derives from them (mj_setConst) is the caller's."""
        for model in models:
            restore(model, self.model)
        self.dynamics.apply(models, self.of_cell(values))
        for attached, numbers in self.of_effects(values):
            if attached.effect.model is not None:
                context = self.context(attached, values)
                for model, of_rollout in zip(models, numbers, strict=True):
                    attached.effect.model(model, of_rollout, context)

    def terms(self, values: Floats) -> list[Term]:
        """Friction of the table and forces of the effects."""
        terms = [
            Term(Kind.TABLE_FRICTION, s.body, np.stack([s.friction, s.creep, s.load], axis=1))
            for s in self.dynamics.sliding(self.of_cell(values))
        ]
        for attached, numbers in self.of_effects(values):
            if attached.effect.forces is not None and attached.present(numbers):
                terms.extend(attached.effect.forces(numbers, self.context(attached, values)))
        return terms

    def start(self, values: Floats, inputs: Floats) -> Floats:
        """(B, s) states at simulated time 0."""
        nq, nv = self.model.nq, self.model.nv
        start = np.tile(self.dynamics.first, (len(values), 1))
        start[:, 1 : 1 + nq], start[:, 1 + nq : 1 + nq + nv] = self.dynamics.start(
            self.of_cell(values), self.of_command(inputs)
        )
        return start

    def controls(self, values: Floats, inputs: Floats, steps: int) -> Floats | None:
        """(B, T, n) what drives MuJoCo (`drives.parts`), controls as the arm follows them; None where nothing does."""
        if not self.drives.size:
            return None
        nu, command = self.model.nu, self.of_command(inputs)
        driven = self.dynamics.controls(self.of_cell(values), command, steps)
        if self.cell.spec.inputs:
            driven = self.drives.fill(driven, self.of_cell(values), command, self.bank, self.time_step)
        controls = driven[..., :nu]
        drawn = list(inputs[:, len(self.cell.input_names) :, None].transpose(1, 0, 2))
        for attached, numbers in self.of_effects(values):
            if attached.effect.controls is not None:
                own = drawn.pop(0) if attached.effect.scattered and drawn else numbers
                controls = attached.effect.controls(controls, own, self.context(attached, values))
        if driven.shape[2] > nu:
            controls = np.concatenate([controls, driven[..., nu:]], axis=2)
        return np.ascontiguousarray(controls)

    def duration(self, values: Floats, inputs: Floats, time_s: Floats) -> float:
        """How long to simulate for what the tracker is asked at (B, F) times [s]."""
        last = float(np.nanmax(time_s))
        effects = self.of_effects(values)
        ahead = sum(a.effect.ahead(numbers, last) for a, numbers in effects if a.effect.ahead is not None)
        return float(np.nanmax(self.cell.simulated_time(self.of_command(inputs), time_s))) + ahead

    def sensed(self, values: Floats, inputs: Floats, time_s: Floats, states: Floats) -> Floats:
        """(B, F, C) what the tracker says at (B, F) times [s]; (B, T + 1, C) raw columns of the states."""
        observe = partial(self.dynamics.observe, self.of_cell(values))

        def perfect(time: Floats) -> Floats:
            return interpolate(states, self.time_step, self.cell.simulated_time(self.of_command(inputs), time), observe)

        sample: Sample = perfect
        for attached, numbers in self.of_effects(values):
            if attached.effect.sensing is not None:
                sample = attached.effect.sensing(sample, numbers, self.context(attached, values))
        return np.asarray(sample(time_s))


def interpolate(
    rows: Floats, time_step: float, time_s: Floats, of_rows: Callable[[Floats], Floats] = np.asarray
) -> Floats:
    """(B, F, C) linear interpolation at (B, F) times of what `of_rows` makes of (B, T, C) rows, each for itself.

    Before the start and after the end it holds.
    """
    at = np.clip(np.nan_to_num(time_s) / time_step, 0, rows.shape[1] - 1)
    low = np.minimum(at.astype(int), rows.shape[1] - 2)
    share = (at - low)[:, :, None]
    of = np.arange(len(rows))[:, None]
    return np.asarray((1 - share) * of_rows(rows[of, low]) + share * of_rows(rows[of, low + 1]))

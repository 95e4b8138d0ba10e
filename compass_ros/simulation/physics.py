"""What a parameter vector means: the cell's values, then the quantities of each attached effect."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import mujoco
import numpy as np

from compass_ros.cells import Cell
from compass_ros.cells.drives import RUN_IN_S, Drive, Drives
from compass_ros.cells.dynamics import Dynamics
from compass_ros.cells.sensors import units_of
from compass_ros.cells.signals import Signal
from compass_ros.cells.start import input_names, positions_in_state
from compass_ros.simulation.effects.attached import Attached
from compass_ros.simulation.effects.effect import Context, Sample, restore, table_friction
from compass_ros.simulation.native.program import Term
from compass_ros.simulation.sensing import link, through
from compass_ros.simulation.site_kinds import SiteKind
from compass_ros.simulation.sites import Places, Site
from compass_ros.types import Bools, Floats, Ints, Parameter

Acting = tuple[Attached, Floats, tuple[Site, ...]]
"""An effect, its numbers and what it acts on."""


@dataclass(frozen=True)
class Physics:
    """A cell with effects, asked for B rollouts at once: (B, P) values, (B, A) inputs.

    The inputs may go on with the rollout's own numbers of each scattered effect, which `own` puts in place of values.
    Raises ConfigError where an effect acts on what the scene lacks.
    """

    cell: Cell
    dynamics: Dynamics
    places: Places
    effects: tuple[Attached, ...]
    drives: Drives
    bank: tuple[Drive, ...] = ()
    """Recorded inputs; the input `window` says which of them a rollout has."""

    def __post_init__(self) -> None:
        self._sites  # noqa: B018 - raises where an effect cannot act

    @cached_property
    def _sites(self) -> tuple[tuple[Site, ...], ...]:
        """What each effect acts on."""
        return tuple(attached.sites(self.places) for attached in self.effects)

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

    def own(self, values: Floats, inputs: Floats) -> Floats:
        """(B, P) values with each rollout's own numbers of what differs by chance, where the inputs say them."""
        at, told = len(self.cell.parameters), inputs[:, len(self.cell.input_names) :]
        if not told.shape[1]:
            return values
        out = values.copy()
        for attached in self.effects:
            size = len(attached.effect.quantities)
            if attached.drawn:
                out[:, at : at + size], told = told[:, :size], told[:, size:]
            at += size
        return out

    def acting(self, values: Floats) -> list[Acting]:
        """The same with the sites of each."""
        return [(*one, sites) for one, sites in zip(self.of_effects(values), self._sites, strict=True)]

    def of_command(self, inputs: Floats) -> Floats:
        """The part of the inputs that the cell knows."""
        return inputs[:, : len(self.cell.input_names)]

    def context(self, sites: tuple[Site, ...], values: Floats) -> Context:
        """What the hooks of an effect on some sites are told."""
        turns = tuple(tuple(range(s.first + 3, s.first + s.size)) for s in self.cell.signals if s.filmed)
        sliding = {s.body: s for s in self.dynamics.sliding(self.of_cell(values))}
        return Context(sites, sliding, self.cell.filmed, turns, self.time_step)

    def write(self, models: Sequence[mujoco.MjModel], values: Floats) -> None:
        """Parameters and effects into B models. What MuJoCo derives from them (mj_setConst) is the caller's."""
        for model in models:
            restore(model, self.model)
        self.dynamics.apply(models, self.of_cell(values))
        for attached, numbers, sites in self.acting(values):
            if attached.effect.model is not None:
                context = self.context(sites, values)
                for model, of_rollout in zip(models, numbers, strict=True):
                    attached.effect.model(model, of_rollout, context)

    def terms(self, values: Floats) -> list[Term]:
        """Friction of the table and forces of the effects."""
        terms = [table_friction(s, self.places) for s in self.dynamics.sliding(self.of_cell(values))]
        for attached, numbers, sites in self.acting(values):
            if attached.effect.forces is not None and attached.present(numbers):
                terms.extend(attached.effect.forces(numbers, self.context(sites, values)))
        return terms

    def start(self, values: Floats, inputs: Floats) -> Floats:
        """(B, s) states at simulated time 0."""
        nq, nv = self.model.nq, self.model.nv
        start = np.tile(self.dynamics.first, (len(values), 1))
        start[:, 1 : 1 + nq], start[:, 1 + nq : 1 + nq + nv] = self.dynamics.start(
            self.of_cell(values), self.truly(values, self.of_command(inputs))
        )
        self.drives.begin(start[:, 1 : 1 + nq], self.of_cell(values), self.of_command(inputs), self.bank)
        return start

    @cached_property
    def _read(self) -> tuple[Ints, Ints]:
        """Inputs that say where what a camera sees begins, and the columns of an observation they were read from."""
        inputs: list[int] = []
        columns: list[int] = []
        at = len(self.cell.action)
        for spec in self.cell.starts:
            signal = self.cell.signal(spec.object)
            count = positions_in_state(signal) if signal_kind(signal) == "camera" else 0
            inputs += range(at, at + count)
            columns += range(signal.first, signal.first + count)
            at += len(input_names(spec, signal))
        return np.array(inputs, int), np.array(columns, int)

    def truly(self, values: Floats, inputs: Floats) -> Floats:
        """(B, A) inputs with first places as they are, where cameras with laws said what was read, to second order."""
        at, columns = self._read
        laws = [one for one in self.acting(values) if one[0].effect.sensing is not None and one[0].present(one[1])]
        if not (len(at) and laws):
            return inputs
        rows = np.zeros((len(inputs), 1, len(self.cell.channels)))
        rows[:, 0, columns] = inputs[:, at]
        still, out = np.zeros((len(inputs), 1)), inputs.copy()
        for _ in range(2):
            sample = self._through(laws, values, partial(_always, rows.copy()))
            rows[:, 0, columns] = inputs[:, at] - (sample(still) - rows)[:, 0, columns]
        out[:, at] = rows[:, 0, columns]
        return out

    def controls(self, values: Floats, inputs: Floats, steps: int) -> Floats | None:
        """(B, T, n) what drives MuJoCo (`drives.parts`), controls as actuators follow them; None where nothing does."""
        if not self.drives.size:
            return None
        command = self.of_command(inputs)
        laws = [(*one, law) for one in self.acting(values) if (law := one[0].effect.controls) is not None]
        early = round(RUN_IN_S / self.time_step) if laws and self.cell.spec.inputs else 0
        driven = self.dynamics.controls(self.of_cell(values), command, steps)
        if early:
            driven = np.pad(driven, ((0, 0), (early, 0), (0, 0)))
        if self.cell.spec.inputs:
            driven = self.drives.fill(driven, self.of_cell(values), command, self.bank, self.time_step, early)
        recorded = {name for i in self.cell.spec.inputs for name in i.targets}
        for _, numbers, sites, law in laws:
            context = self.context(sites, values)
            for drive in sites:
                columns, known = list(drive.actuators), bool(recorded & set(drive.names))
                own = np.s_[:, 0 if known else early :, columns]
                before = driven[:, 0, columns] if known else self._standing(drive, values, inputs)
                driven[own] = law(driven[own], numbers, replace(context, sites=(drive,), before=before))
        return np.ascontiguousarray(driven[:, early:])

    def _standing(self, drive: Site, values: Floats, inputs: Floats) -> Floats | None:
        """(B, 1) the command at which a position servo stands at the start; None for other drives, which rest at 0."""
        if drive.kind != "position_drive":
            return None
        (actuator,), model = drive.actuators, self.model
        gain, (bias, stiffness, _) = model.actuator_gainprm[actuator, 0], model.actuator_biasprm[actuator, :3]
        data, first = mujoco.MjData(model), self.start(values, inputs)[:, 1 : 1 + model.nq]
        out = np.empty((len(first), 1))
        for i, positions in enumerate(first):
            data.qpos[:] = positions
            mujoco.mj_fwdPosition(model, data)
            out[i] = -(bias + stiffness * data.actuator_length[actuator]) / gain
        return out

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

        return np.asarray(self._through(self.acting(values), values, perfect)(time_s))

    def _through(self, laws: Sequence[Acting], values: Floats, sample: Sample) -> Sample:
        """What sensors with some laws make of what perfect ones say."""
        links = []
        for attached, numbers, sites in laws:
            if (law := attached.effect.sensing) is not None:
                links.append((self._of_signals(sites), link(law, numbers, self.context(sites, values))))
        return through(links, sample)

    def _of_signals(self, sites: tuple[Site, ...]) -> Bools:
        """(C,) which columns of an observation belong to some signals."""
        return np.isin(np.arange(len(self.cell.channels)), [c for site in sites for c in site.columns])


def _always(rows: Floats, time: Floats) -> Floats:
    """(B, 1, C) rows whatever the time."""
    return np.broadcast_to(rows, (*time.shape, rows.shape[2]))


def signal_kind(signal: Signal) -> SiteKind:
    """What measures a signal."""
    if signal.jointed:
        return "encoder"
    return "camera" if signal.filmed else "sensor"


def places_of(cell: Cell, dynamics: Dynamics, drives: Drives) -> Places:
    """The sites of a cell's scene."""
    sliding = frozenset(s.body for s in dynamics.sliding(cell.defaults[None]))
    return Places(dynamics.model, sliding, tuple(_measured(cell, dynamics.model)), drives.commanded)


def _measured(cell: Cell, model: mujoco.MjModel) -> Iterator[Site]:
    """Each signal of a cell, and each number of those that have several."""
    for signal in cell.signals:
        kind, units = signal_kind(signal), units_of(model, signal, str(cell.path))
        columns = tuple(range(signal.first, signal.first + signal.size))
        yield Site(kind, (signal.name,), columns=columns, quantity=signal.quantity, units=units)
        for number, column, unit in zip(signal.numbers, columns, units, strict=True):
            if len(columns) > 1:
                name = f"{signal.name}.{number}"
                yield Site(kind, (name,), columns=(column,), quantity=signal.quantity, units=(unit,))


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

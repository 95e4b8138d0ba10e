"""Recorded episodes bound to a simulator: predictions at the recorded stamps, and trajectory differences."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from compass_ros.cells import Cell
from compass_ros.cells.drives import Drive
from compass_ros.cells.signals import Signal
from compass_ros.errors import DataError
from compass_ros.simulation.factors import factor_distance
from compass_ros.simulation.manifold import apart, charted, on_manifold
from compass_ros.simulation.simulator import Simulator
from compass_ros.simulation.windows import drive
from compass_ros.types import Bools, Episode, Floats, Gap, Ints, SignalGap, Track

_NS = 1e-9
STILL_S = 0.6
"""Frames earlier than this before the command are left out: somebody may still be placing the objects [s]."""
GUESSED = 5.0
"""A frame whose stated standard deviation is this many times the track's median was bridged, not seen."""


@dataclass(frozen=True)
class Recordings:
    """Episodes as arrays. E episodes, F frames (padded), A inputs, C observed columns, S control steps."""

    names: tuple[str, ...]
    inputs: Floats
    """(E, A) actions in the cell's order."""
    time_s: Floats
    """(E, F) since the command; padding repeats the last frame."""
    measured: Floats
    """(E, F, C); NaN where an object was not seen, and in the padding."""
    steps_s: Floats
    """(S,) control times 0, dt, ..., horizon dt."""
    at_steps: Floats
    """(E, S, C) measured, linearly interpolated at the control times."""
    stated: Floats
    """(C,) typical standard deviation of a position as the sensor states it [m]; -inf where it does not."""
    start_std: Floats
    """(A,) standard deviation of the first states as the least sure episode says it; 0 where none says anything.

    One for all, and not too small for any: the frames that follow say where a window began far better than this.
    """
    drives: tuple[Drive, ...] = ()
    """Recorded inputs of each episode; empty where the cell has none."""
    recording: tuple[str, ...] = ()
    """(E,) of which recording each episode is a window; its own name where it is none."""

    def numbered(self, first: int) -> Recordings:
        """The same with recorded inputs numbered from `first` on, for a simulator that was given others before."""
        if not self.drives:
            return self
        inputs = self.inputs.copy()
        inputs[:, -1] = first + np.arange(len(inputs))
        return replace(self, inputs=inputs)


def recordings(cell: Cell, episodes: Sequence[Episode]) -> Recordings:
    """Arrange episodes (or windows) for a cell. Raises DataError where an episode lacks an object of the cell."""
    if not episodes:
        raise DataError(f"no episodes to compare with {cell.name}")
    rows = [_arrange(cell, episode) for episode in episodes]
    frames = max(len(time) for time, _ in rows)
    time_s = np.stack([np.pad(time, (0, frames - len(time)), mode="edge") for time, _ in rows])
    measured = np.full((len(rows), frames, len(cell.channels)), np.nan)
    for e, (time, values) in enumerate(rows):
        measured[e, : len(time)] = values
    steps = cell.control_dt * np.arange(cell.horizon + 1)
    at_steps = np.stack([_at(steps, time, values) for time, values in rows])
    inputs = np.stack([cell.inputs(episode) for episode in episodes])
    stated = np.nanmedian(np.stack([_stated(cell, episode) for episode in episodes]), axis=0)
    return Recordings(
        names=tuple(e.name for e in episodes),
        inputs=inputs,
        time_s=time_s,
        measured=measured,
        steps_s=steps,
        at_steps=at_steps,
        stated=stated,
        start_std=np.max([cell.stated_std(episode) for episode in episodes], axis=0),
        drives=tuple(drive(cell, episode) for episode in episodes) if cell.spec.inputs else (),
        recording=tuple(e.recording or e.name for e in episodes),
    ).numbered(0)


def _arrange(cell: Cell, episode: Episode) -> tuple[Floats, Floats]:
    """(F,) times and (F, C) measurements on the union of the tracks' stamps, up to the cell's horizon."""
    known = {track.object: track for track in episode.tracks}
    missing = [s.name for s in cell.signals if s.name not in known or len(known[s.name].stamp_ns) < 2]
    if missing:
        raise DataError(f"{episode.source or episode.name}: no track of {', '.join(missing)}; has {sorted(known)}")
    stamps = np.unique(np.concatenate([known[s.name].stamp_ns for s in cell.signals]))
    time = (stamps - episode.start_ns) * _NS
    keep = (time >= -STILL_S) & (time <= cell.duration + 1e-6)
    stamps, time = stamps[keep], time[keep]
    if np.sum(time >= 0) < 2:
        raise DataError(f"{episode.source or episode.name}: no frames within {cell.duration:g} s after the command")
    values = np.full((len(stamps), len(cell.channels)), np.nan)
    for signal in cell.signals:
        track = known[signal.name]
        inside = np.isin(track.stamp_ns, stamps) & _seen(track)
        values[np.searchsorted(stamps, track.stamp_ns[inside]), signal.columns] = track.value[inside]
        if np.sum(~np.isnan(values[time >= 0, signal.columns]), axis=0).min() < 2:
            where = episode.source or episode.name
            raise DataError(f"{where}: {signal.name} was not seen within {cell.duration:g} s after the command")
        if signal.quantity == "pose":
            _follow(values[:, signal.first + 3 : signal.first + 7])
    return time, values


def _stated(cell: Cell, episode: Episode) -> Floats:
    """(C,) median of the tracks' standard deviations; -inf where the sensor says nothing, or speaks of no position."""
    stated: list[float] = []
    for signal in cell.signals:
        std = episode.track(signal.name).std
        known = signal.size if signal.jointed else 3
        stated += [-np.inf if std is None or i >= known else float(np.median(std)) for i in range(signal.size)]
    return np.array(stated)


def _follow(quaternions: Floats) -> None:
    """Choose the sign of each of (F, 4) quaternions, in place: the first scalar part positive, then without jumps."""
    seen = quaternions[~np.isnan(quaternions).any(axis=1)]
    turns = np.concatenate([seen[:1, 0], np.sum(seen[1:] * seen[:-1], axis=1)])
    quaternions[~np.isnan(quaternions).any(axis=1)] = seen * np.cumprod(np.where(turns < 0, -1.0, 1.0))[:, None]


def _seen(track: Track) -> Bools:
    """(F,) False where the sensor says that it only predicted: an object behind the arm, say."""
    if track.std is None:
        return np.ones(len(track.stamp_ns), bool)
    return np.asarray(track.std <= GUESSED * np.median(track.std))


def _at(steps: Floats, time: Floats, values: Floats) -> Floats:
    """(S, C) each column interpolated over the frames in which it was seen."""
    columns = []
    for column in values.T:
        seen = ~np.isnan(column)
        columns.append(np.interp(steps, time[seen], column[seen]))
    return np.stack(columns, axis=1)


class Replay:
    """A simulator asked about recorded episodes. Both functions are batched over pairs (values, episode)."""

    def __init__(self, simulator: Simulator, data: Recordings, launch: Floats | None = None) -> None:
        """`launch`: (E, A) by how much each episode's true inputs (`Simulator.inputs`) differ from what was said."""
        self.simulator = simulator
        self.data = data
        self.inputs = data.inputs if launch is None else simulator.inputs(data.inputs) + launch

    def predict(self, values: Floats, episode: Ints) -> Floats:
        """(B, F, C) what the tracker would have said at the recorded stamps, for (B, P) values and (B,) episodes."""
        return self.simulator.observe(values, self.inputs[episode], self.data.time_s[episode])

    def differences(self, values: Floats, episode: Ints) -> Floats:
        """(B, K) trajectory difference d_k: sum over the control steps of the 2-norm (types.Differences)."""
        steps = np.broadcast_to(self.data.steps_s, (len(values), len(self.data.steps_s)))
        simulated = self.simulator.observe(values, self.inputs[episode], steps)
        return np.asarray(factor_distance(self.simulator.cell, simulated, self.data.at_steps[episode]).sum(axis=1))

    def gap(self, values: Floats, noise: Floats | None = None) -> Gap:
        """How far the (P,) values are from all episodes; `noise`: (C,) rms of the measurements' own errors."""
        episodes = np.arange(len(self.data.names))
        tiled = np.tile(values, (len(episodes), 1))
        d = self.differences(tiled, episodes).mean(axis=0)
        cell = self.simulator.cell
        measured = charted(cell, self.data.measured)
        missed = apart(cell, self.predict(tiled, episodes), measured)
        missed = np.where(np.isnan(missed) & ~np.isnan(measured), np.inf, missed)  # a simulator that lost the body
        of_factor = dict(zip([f.name for f in cell.factors], d.tolist(), strict=True))
        gap = Gap(of_factor, rms_distance(cell, missed), by_signal(self.simulator, missed))
        return gap if noise is None else floored(self.simulator, gap, noise)


def floored(simulator: Simulator, gap: Gap, noise: Floats) -> Gap:
    """The same with what the (C,) noise alone would leave of each signal."""
    floors = by_signal(simulator, on_manifold(simulator.cell, noise)[None, None])
    return replace(gap, signals={name: replace(s, floor=floors[name].rms) for name, s in gap.signals.items()})


def rms_distance(cell: Cell, missed: Floats) -> float:
    """Root mean square distance of positions over all frames and objects, for (E, F, C) differences, NaN where none."""
    return _rms(missed, positions(cell).values())


def _rms(missed: Floats, groups: Iterable[range]) -> float:
    """Root mean square over all frames and groups of the 2-norm of each group's columns of (E, F, C) differences."""
    distance2 = [np.sum(missed[:, :, list(group)] ** 2, axis=2).ravel() for group in groups]
    return float(np.sqrt(np.nanmean(np.concatenate(distance2))))


def by_signal(simulator: Simulator, missed: Floats) -> dict[str, SignalGap]:
    """The same by signal, and in it by joint, each in its unit; a pose's orientation stands beside its position."""
    out = {}
    for signal, units in simulator.units.items():
        for name, columns in of_one_unit(signal).items():
            own = range(signal.first + columns.start, signal.first + columns.stop)
            groups = [range(c, c + 1) for c in own] if signal.jointed else [own]
            joints = dict(zip(signal.numbers, (_rms(missed, [g]) for g in groups), strict=False))
            parts = joints if len(groups) > 1 else {}
            out[name] = SignalGap(_rms(missed, groups), units[columns.start], parts=parts)
    return out


def of_one_unit(signal: Signal) -> dict[str, range]:
    """Numbers of a signal that have one unit, by what they are called."""
    if signal.quantity == "pose":
        return {signal.name: range(3), f"{signal.name} orientation": range(3, 6)}
    if signal.quantity == "wrench":
        return {signal.name: range(3), f"{signal.name} torque": range(3, 6)}
    return {signal.name: range(signal.size)}


def positions(cell: Cell) -> dict[str, range]:
    """Columns of an observation whose 2-norm says how far off a fitted object or joint is, orientations left out.

    Where nothing that is fitted says where anything is, all that is fitted counts.
    """
    fitted = [s for s in cell.signals if s.fitted]
    out: dict[str, range] = {}
    for s in [s for s in fitted if s.places] or fitted:
        if s.quantity == "joint_position" or not s.places:
            out |= {f"{s.name}.{number}": range(s.first + i, s.first + i + 1) for i, number in enumerate(s.numbers)}
        else:
            out[s.name] = range(s.first, s.first + min(s.size, 3))
    return out

"""Recorded episodes bound to a simulator: predictions at the recorded stamps, and trajectory differences."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from compass_ros.cells import Cell
from compass_ros.errors import DataError
from compass_ros.simulation.factors import factor_distance
from compass_ros.simulation.simulator import Simulator
from compass_ros.types import QUANTITY_SIZE, Bools, Episode, Floats, Gap, Ints, Track

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


def recordings(cell: Cell, episodes: Sequence[Episode]) -> Recordings:
    """Arrange episodes for a cell. Raises DataError where an episode lacks an object of the cell."""
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
    return Recordings(tuple(e.name for e in episodes), inputs, time_s, measured, steps, at_steps, stated)


def _arrange(cell: Cell, episode: Episode) -> tuple[Floats, Floats]:
    """(F,) times and (F, C) measurements on the union of the tracks' stamps, up to the cell's horizon."""
    known = {track.object: track for track in episode.tracks}
    missing = [o.name for o in cell.objects if o.name not in known or len(known[o.name].stamp_ns) < 2]
    if missing:
        raise DataError(f"{episode.source or episode.name}: no track of {', '.join(missing)}; has {sorted(known)}")
    stamps = np.unique(np.concatenate([known[o.name].stamp_ns for o in cell.objects]))
    time = (stamps - episode.start_ns) * _NS
    keep = (time >= -STILL_S) & (time <= cell.duration + 1e-6)
    stamps, time = stamps[keep], time[keep]
    if np.sum(time >= 0) < 2:
        raise DataError(f"{episode.source or episode.name}: no frames within {cell.duration:g} s after the command")
    values = np.full((len(stamps), len(cell.channels)), np.nan)
    column = 0
    for spec in cell.objects:
        track, size = known[spec.name], QUANTITY_SIZE[spec.quantity]
        inside = np.isin(track.stamp_ns, stamps) & _seen(track)
        values[np.searchsorted(stamps, track.stamp_ns[inside]), column : column + size] = track.value[inside]
        if np.sum(~np.isnan(values[time >= 0, column])) < 2:
            where = episode.source or episode.name
            raise DataError(f"{where}: {spec.name} was not seen within {cell.duration:g} s after the command")
        if spec.quantity == "pose":
            _follow(values[:, column + 3 : column + 7])
        column += size
    return time, values


def _stated(cell: Cell, episode: Episode) -> Floats:
    """(C,) median of the tracks' standard deviations; -inf where the sensor says nothing, or speaks of no position."""
    stated: list[float] = []
    for spec in cell.objects:
        std = episode.track(spec.name).std
        size = QUANTITY_SIZE[spec.quantity]
        stated += [-np.inf if std is None or i >= 3 else float(np.median(std)) for i in range(size)]
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

    def gap(self, values: Floats) -> Gap:
        """How far the (P,) values are from all episodes."""
        episodes = np.arange(len(self.data.names))
        tiled = np.tile(values, (len(episodes), 1))
        d = self.differences(tiled, episodes).mean(axis=0)
        missed = self.predict(tiled, episodes) - self.data.measured
        names = [f.name for f in self.simulator.cell.factors]
        return Gap(dict(zip(names, d.tolist(), strict=True)), rms_distance(self.simulator.cell, missed))


def rms_distance(cell: Cell, missed: Floats) -> float:
    """Root mean square distance of positions over all frames and objects, for (E, F, C) differences, NaN where none."""
    own = [list(columns) for columns in positions(cell).values()]
    distance2 = np.concatenate([np.sum(missed[:, :, columns] ** 2, axis=2).ravel() for columns in own])
    return float(np.sqrt(np.nanmean(distance2)))


def positions(cell: Cell) -> dict[str, range]:
    """Columns of an observation that hold the position of each object (a joint's: its angle), orientations left out."""
    out, column = {}, 0
    for spec in cell.objects:
        size = QUANTITY_SIZE[spec.quantity]
        out[spec.name] = range(column, column + min(size, 3))
        column += size
    return out

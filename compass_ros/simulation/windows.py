"""Long recordings cut into windows, each an episode with a first state of its own: measured, and free within its noise.

A robot under control forgets where it began within a second, and a passive one amplifies every error: either way a
window of seconds says what minutes say, and a Jacobian over it stays accurate. The windows of a recording do not
overlap.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from compass_ros.cells import Cell
from compass_ros.cells.drives import RUN_IN_S, Drive
from compass_ros.cells.series import InputSpec
from compass_ros.cells.signals import Signal
from compass_ros.cells.start import state_names
from compass_ros.errors import DataError
from compass_ros.types import Episode, Floats, Ints, LeftOut, Track

AROUND_S = 0.05
"""Frames so near the start of a window give its first state [s]: a joint's acceleration changes over that time by
little, since the closed loops of robots have bandwidths of some hertz."""
FEWEST, MOST = 5, 101
"""Frames of that fit: a parabola has three numbers; beyond a hundred the rate is known better than anything else."""
_SHORTEST = 0.5
"""Share of a window's length that the rest of a recording must have to be a window too."""
_MOVES = 8.0
"""A signal moves where its range is more than this many standard deviations of its noise: of windows with a thousand
frames of white noise, one in a thousand has a range beyond 8.2."""
_NS = 1e-9


def windows(cell: Cell, episodes: Sequence[Episode]) -> list[Episode]:
    """The windows of recordings, in order; without `windows` in the cell the recordings themselves.

    Raises DataError where a recording is too short for one, or where nothing moves in any.
    """
    spec = cell.spec.windows
    if spec is None:
        return list(episodes)
    out: list[Episode] = []
    for episode in episodes:
        own = list(_cut(cell, _without_gaps(cell, episode), spec.length_s))
        moving = [window for window in own if _moves(cell, window)]
        if not moving:
            raise DataError(f"{episode.source or episode.name}: nothing moves in its {len(own)} windows")
        out += moving
    return out


def usable(cell: Cell, recordings: Sequence[Episode]) -> tuple[list[Episode], tuple[LeftOut, ...]]:
    """Recordings that have a window in which something moves; the others, and why.

    Raises DataError where none has.
    """
    chosen: list[Episode] = []
    out: list[LeftOut] = []
    refused: DataError | None = None
    for recording in recordings:
        try:
            windows(cell, [recording])
            drive(cell, recording)
        except DataError as error:
            refused = error
            out.append(LeftOut(recording.source or recording.name, str(error)))
        else:
            chosen.append(recording)
    if refused is not None and not chosen:
        raise refused
    return chosen, tuple(out)


def drive(cell: Cell, episode: Episode) -> Drive:
    """The recorded inputs of an episode, on its own clock. Raises DataError where one is missing."""
    tracks = _without_gaps(cell, episode).inputs
    return Drive(tuple((t.stamp_ns - episode.start_ns) * _NS for t in tracks), tuple(t.value for t in tracks))


def _without_gaps(cell: Cell, episode: Episode) -> Episode:
    """With the inputs of the cell alone, in its order, without gaps. Raises DataError where one is missing."""
    known = {track.object: track for track in episode.inputs}
    own = []
    for spec in cell.spec.inputs:
        track = known.get(spec.name)
        if track is None or not len(track.stamp_ns):
            raise DataError(f"{episode.source or episode.name}: no input '{spec.name}' in it; it has {sorted(known)}")
        own.append(track if not np.isnan(track.value).any() else replace(track, value=_held(track)))
    return replace(episode, inputs=tuple(own))


def _held(track: Track) -> Floats:
    """(F, D) each number holding its last value where a message lacked it; before the first one, the first."""
    rows = np.arange(len(track.value))
    out = np.empty_like(track.value)
    for column, values in enumerate(track.value.T):
        seen = np.flatnonzero(~np.isnan(values))
        if not len(seen):
            raise DataError(f"input '{track.object}': its number {column + 1} is in no message")
        out[:, column] = values[seen[np.maximum(np.searchsorted(seen, rows, side="right") - 1, 0)]]
    return out


def _cut(cell: Cell, episode: Episode, length_s: float) -> Iterator[Episode]:
    """Windows of one recording. Raises DataError where inputs and signals share less than half a window."""
    series = [t for t in (*episode.tracks, *episode.inputs) if len(t.stamp_ns)]
    if not series:
        raise DataError(f"{episode.source or episode.name}: no inputs and no signals in it")
    begin = max(int(t.stamp_ns[0]) for t in series)
    end = min(int(t.stamp_ns[-1]) for t in series)
    length = round(length_s / _NS)
    count = (end - begin) // length + ((end - begin) % length >= _SHORTEST * length)
    if count < 1:
        raise DataError(
            f"{episode.source or episode.name}: all inputs and signals are there for {(end - begin) * _NS:.2f} s; "
            f"expected at least {_SHORTEST * length_s:g} s"
        )
    for i in range(int(count)):
        yield _window(cell, episode, begin + i * length, min(begin + (i + 1) * length, end))


def _window(cell: Cell, episode: Episode, start_ns: int, end_ns: int) -> Episode:
    """One window: its frames, what drove it before and in it, and its first state."""
    signals = {s.object: cell.signal(s.object) for s in cell.starts}
    around = {t.object: t for t in episode.tracks}
    first = {name: first_state(signal, around[name], around, cell, start_ns) for name, signal in signals.items()}
    rate = cell.spec.windows.rate_hz if cell.spec.windows else math.inf
    tracks = tuple(_thinned(_between(t, start_ns, end_ns), rate) for t in episode.tracks)
    named = {spec.name: spec for spec in cell.spec.inputs}
    return replace(
        episode,
        name=f"{episode.name} at {(start_ns - episode.start_ns) * _NS:.1f} s",
        recording=episode.name,
        start_ns=start_ns,
        tracks=tracks,
        inputs=tuple(_driving(cell, named[t.object], t, start_ns) for t in episode.inputs),
        initial_state={name: tuple(state.tolist()) for name, (state, _) in first.items()},
        initial_std={name: tuple(std.tolist()) for name, (_, std) in first.items()},
    )


def _driving(cell: Cell, spec: InputSpec, track: Track, start_ns: int) -> Track:
    """What an input says from RUN_IN_S before a window's start to its end, as early and as late as its delay may be.

    With all of a long recording in each of its windows, time and memory would grow with the square of its length.
    """
    delays = np.atleast_1d(np.asarray(spec.delay_s, float)).tolist()
    for p, one in zip(cell.parameters, cell.spec.parameters, strict=False):
        if one.field.partition("[")[0] == "input_delay_s" and one.of == spec.name:
            delays += [p.low, p.high]
    begin_ns = start_ns - math.ceil((max(delays) + RUN_IN_S) / _NS)
    end_ns = start_ns + math.ceil((cell.duration - min(delays)) / _NS)
    first = max(int(np.searchsorted(track.stamp_ns, begin_ns, side="right")) - 1, 0)
    return _chosen(track, slice(first, int(np.searchsorted(track.stamp_ns, end_ns)) + 1))


def _thinned(track: Track, rate_hz: float) -> Track:
    """Every n-th frame, so that there are at most so many in a second."""
    span = (track.stamp_ns[-1] - track.stamp_ns[0]) * _NS if len(track.stamp_ns) > 1 else 0.0
    every = max(math.ceil((len(track.stamp_ns) - 1) / (span * rate_hz) - 0.01), 1) if span else 1
    return _chosen(track, slice(None, None, every))


def _between(track: Track, start_ns: int, end_ns: int) -> Track:
    return _chosen(track, slice(*np.searchsorted(track.stamp_ns, [start_ns, end_ns])))


def _chosen(track: Track, chosen: slice) -> Track:
    return replace(
        track,
        stamp_ns=track.stamp_ns[chosen],
        value=track.value[chosen],
        std=None if track.std is None else track.std[chosen],
    )


def first_state(
    signal: Signal, track: Track, tracks: dict[str, Track], cell: Cell, start_ns: int
) -> tuple[Floats, Floats]:
    """State of what a signal tracks at a moment, as `cells.start` orders it, and its standard deviation.

    Positions and rates are those of the parabola through the frames around that moment (Savitzky and Golay 1964).
    What a cubic through the same frames says differently counts as an error beside that of least squares: how a servo
    answers to a step of its target is no parabola. Rates of joints that a velocity signal measures are that signal's
    mean instead. The standard deviation of an orientation is that of a rotation vector.
    """
    sigma = signal.noise or (signal.step or 0.0) / math.sqrt(12) or cell.spec.noise_m
    if signal.quantity == "pose":
        return _first_pose(track, start_ns, sigma)
    fits = [_fit(track, start_ns, sigma, [column]) for column in range(signal.size)]
    positions, rates = (np.array([fit[0][i, 0] for fit in fits]) for i in (0, 1))
    position_std, rate_std = (np.array([fit[1][i, 0] for fit in fits]) for i in (0, 1))
    measured = _measured_rates(signal, tracks, cell, start_ns)
    known = ~np.isnan(measured[0])
    state = np.concatenate([positions, np.where(known, measured[0], rates)])
    if len(state) != len(state_names(signal)):
        raise DataError(f"{signal.name}: cannot begin a window with a {signal.quantity}")
    return state, np.concatenate([position_std, np.where(known, measured[1], rate_std)])


def _fit(track: Track, start_ns: int, sigma: float, columns: list[int]) -> tuple[Floats, Floats]:
    """(2, D) value and rate at a moment of some columns together, and their standard deviations."""
    own = near(track, start_ns, columns)
    time = (track.stamp_ns[own] - start_ns) * _NS
    return _polynomial(time, track.value[own][:, columns], sigma)


def _polynomial(time: Floats, value: Floats, sigma: float) -> tuple[Floats, Floats]:
    """(2, D) value and rate at time 0 of (n, D) values, and their standard deviations."""
    scale = max(float(np.abs(time).max()), 1e-9)
    unit = np.array([[1.0], [scale]])
    solve = [np.linalg.pinv(np.vander(time / scale, min(n, len(time)), increasing=True))[:2] for n in (3, 4)]
    parabola, cubic = (one @ value / unit for one in solve)
    of_noise = sigma * np.linalg.norm(solve[0], axis=1)[:, None] / unit
    return parabola, np.hypot(of_noise, cubic - parabola)


def _first_pose(track: Track, start_ns: int, sigma: float) -> tuple[Floats, Floats]:
    own = near(track, start_ns, list(range(7)))
    time, value = (track.stamp_ns[own] - start_ns) * _NS, track.value[own]
    rotations = Rotation.from_quat(value[:, [4, 5, 6, 3]])
    middle = rotations[int(np.argmin(np.abs(time)))]
    (place, velocity), (place_std, velocity_std) = _polynomial(time, value[:, :3], sigma)
    (turn, rate), (turn_std, rate_std) = _polynomial(time, (middle.inv() * rotations).as_rotvec(), sigma)
    first = (middle * Rotation.from_rotvec(turn)).as_quat()[[3, 0, 1, 2]]
    state = np.concatenate([place, first, velocity, rate])
    return state, np.concatenate([place_std, np.zeros(4), velocity_std, rate_std, turn_std])


def near(track: Track, start_ns: int, columns: list[int]) -> Ints:
    """Frames around a moment: within AROUND_S of it, at least FEWEST and at most MOST of them."""
    seen = _seen_around(track, int(np.searchsorted(track.stamp_ns, start_ns)), columns)
    if not len(seen):
        raise DataError(f"signal '{track.object}': its number {columns[0] + 1} is in no message")
    away = np.abs(track.stamp_ns[seen] - start_ns)
    order = seen[np.argsort(away, kind="stable")]
    count = int(np.clip(np.sum(away <= AROUND_S / _NS), FEWEST, MOST))
    return np.sort(order[:count])


def _seen_around(track: Track, middle: int, columns: list[int]) -> Ints:
    """Frames in which some columns were seen: MOST before a frame and MOST from it on, or all that there are."""
    reach, frames = MOST, len(track.stamp_ns)
    while True:
        first, last = max(middle - reach, 0), min(middle + reach, frames)
        seen = first + np.flatnonzero(~np.isnan(track.value[first:last, columns]).any(axis=1))
        before = int(np.sum(seen < middle))
        if (first == 0 or before >= MOST) and (last == frames or len(seen) - before >= MOST):
            return seen
        reach *= 2


def _measured_rates(signal: Signal, tracks: dict[str, Track], cell: Cell, start_ns: int) -> tuple[Floats, Floats]:
    """(D,) rates of a signal's joints as velocity signals of the cell say them, and their noise; NaN: none does."""
    rates, std = np.full(signal.size, np.nan), np.full(signal.size, np.nan)
    for other in cell.signals:
        if other.quantity != "joint_velocity" or other.noise is None or not signal.jointed:
            continue
        for i, joint in enumerate(signal.at):
            if joint in other.at:
                column = other.at.index(joint)
                own = near(tracks[other.name], start_ns, [column])
                rates[i], std[i] = np.mean(tracks[other.name].value[own, column]), other.noise
    return rates, std


def _moves(cell: Cell, window: Episode) -> bool:
    """Whether a fitted signal moves by more than its noise: a stretch in which nothing happens is no evidence."""
    for track in window.tracks:
        signal = cell.signal(track.object)
        least = least_motion(signal)
        if signal.fitted and any(ranges(values[~np.isnan(values)], least) for values in track.value.T):
            return True
    return False


def least_motion(signal: Signal) -> float:
    """Standard deviation of a signal's noise as the cell says it, or of its step [unit of the signal]; 0: not said."""
    return max(signal.noise or 0.0, (signal.step or 0.0) / math.sqrt(12))


def ranges(values: Floats, least: float) -> bool:
    """Whether the range of (n,) values is beyond that of noise, whose size shows between neighbours."""
    if len(values) < 3:
        return False
    change = np.diff(values)
    noise = 1.4826 * float(np.median(np.abs(change - np.median(change)))) / math.sqrt(2)
    return bool(np.ptp(values) > max(_MOVES * max(noise, least), 1e-12))

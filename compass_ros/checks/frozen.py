"""Values that stop changing while what is measured does not.

Three signs, each of its own kind. Where it moves steadily before and after, and jumps afterwards to where it would have
been: the sensor froze, or lost its messages. Where it scatters by noise everywhere else, to the last bit of no number:
nothing measures that still. Where every value of a noisy motion is said several times: messages are more frequent than
measurements, and all but the first of each are late.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from compass_ros.checks.finding import Finding, told
from compass_ros.checks.series import SIGMAS, Level, Series
from compass_ros.types import Bools, Floats, Ints, Track

SHORTEST = 3
"""Equal samples in a row from which a value counts as frozen: an encoder says one twice in every slow motion."""
STEADY = 0.5
"""Share by which two steps, or a jump and what the speed makes of the time, may differ and be alike."""
VISIBLE = 2.0
"""Least such jump, in distances that are more than noise: a joint that creeps by sticking and slipping makes smaller
ones."""
SILENT = 6
"""Equal samples in a row that noise does not give where two in a row are RARE, by rounding: with a chance of 10^-15."""
RARE = 1e-3
"""Share of the samples that may repeat the one before in such shorter rows; a sensor that counts repeats more."""
HELD = 0.2
"""Share of the samples of a motion that repeat the one before from which messages are too frequent."""
FEWEST = 20
"""Samples of a motion, or values that change, by which that is judged."""
WHITE = (0.6, 1.6)
"""Noise by sixth differences over that by fourth: one for white noise; a motion shows a tenth and less."""


def held(tracks: Mapping[str, Track], level: Level) -> tuple[Mapping[str, Track], tuple[Finding, ...]]:
    """Recordings without messages that repeat the one before, where the values of a motion do; no encoder says them.

    `level`: of the first numbers of the tracks.
    """
    if level.step.any():
        return tracks, ()
    repeating: dict[str, tuple[int, ...]] = {}
    for name, track in tracks.items():
        moving, same = _moving(track.value[:, : len(level.noise)], level), _same(track.value)
        if np.sum(moving) >= FEWEST and np.mean(same[moving]) > HELD:
            repeating[name] = ()
    if not repeating:
        return tracks, ()
    times = float(np.median([1 / np.mean(~_same(tracks[name].value)) for name in repeating]))
    looks = f"each value is said about {times:.0f} times, the messages are more frequent than it: repeats left out"
    found = Finding("held", "repaired", next(iter(tracks.values())).object, repeating, looks)
    return {name: _first_of_each(one) if name in repeating else one for name, one in tracks.items()}, (found,)


def frozen(series: Sequence[Series], level: Level) -> tuple[Finding, ...]:
    """What is frozen in the recordings of one signal."""
    values = [one.value for one in series]
    noisy = not level.step.any() and _seldom_alike(values) and _white(values)
    stuck: dict[str, tuple[int, ...]] = {}
    for one in series:
        runs = [r for r in _runs(one.value) if _caught_up(one, r, level) or (noisy and r[1] - r[0] + 1 >= SILENT)]
        if runs:
            stuck[one.recording] = told(np.concatenate([np.arange(first, last + 1) for first, last in runs]))
    looks = "the value stays the same to the last bit while it should move or scatter: frozen"
    return (Finding("frozen", "bad", series[0].signal, stuck, looks),) if stuck else ()


def _same(value: Floats) -> Bools:
    """(F,) whether a sample repeats the one before."""
    return np.concatenate([[False], (value[1:] == value[:-1]).all(axis=1)])


def _runs(value: Floats) -> list[tuple[int, int]]:
    """First and last index of each row of SHORTEST equal samples or more."""
    start = np.flatnonzero(~_same(value))
    end = np.append(start[1:], len(value)) - 1
    long = end - start + 1 >= SHORTEST
    return list(zip(start[long].tolist(), end[long].tolist(), strict=True))


def _seldom_alike(values: Sequence[Floats]) -> bool:
    """Whether rows of equal samples are long or none: a sensor that counts, or whose noise is small, has short ones.

    Of a few values that change, as of a joint that rests, nothing is known.
    """
    if sum(int(np.sum(~_same(value))) for value in values) < FEWEST:
        return False
    short = 0
    for value in values:
        lengths = np.diff(np.append(np.flatnonzero(~_same(value)), len(value)))
        short += int(np.sum((lengths - 1)[lengths < SILENT]))
    return short <= RARE * sum(map(len, values))


def _caught_up(one: Series, run: tuple[int, int], level: Level) -> bool:
    """Whether it moves steadily before and after, and what it makes up for at once is what that speed makes."""
    first, last = run
    if first < 2 or last + 3 >= len(one.value):
        return False
    apart = np.maximum(level.apart, SIGMAS * level.step)  # a joint that sticks and slips does so by some steps
    jump = (one.value[last + 1] - one.value[last]) / apart
    if np.linalg.norm(jump) < VISIBLE:
        return False
    around = slice(first - 2, last + 4)
    scaled, time = one.value[around] / apart, (one.stamp_ns[around] - one.stamp_ns[first]) * 1e-9
    first, last = 2, last - first + 2
    speed = np.diff(scaled[[first - 2, first - 1, first]], axis=0) / np.diff(time[first - 2 : first + 1])[:, None]
    later = np.diff(scaled[last + 1 : last + 4], axis=0) / np.diff(time[last + 1 : last + 4])[:, None]
    expected = (speed.mean(axis=0) + later.mean(axis=0)) / 2 * (time[last + 1] - time[first])
    steady = _alike(speed[0], speed[1]) and _alike(later[0], later[1])
    onwards = float(np.sum(speed.mean(axis=0) * jump)) > 0  # a joint that sticks where it turns round jumps back
    return steady and onwards and _alike(jump, expected)


def _alike(one: Floats, other: Floats) -> bool:
    return bool(np.linalg.norm(one - other) < STEADY * max(np.linalg.norm(one), np.linalg.norm(other)))


def _white(values: Sequence[Floats]) -> bool:
    """Whether what changes fastest in these series is white noise, and not the motion's own curvature."""
    for c in range(values[0].shape[1]):
        sizes = []
        for order, gain in ((4, 70.0), (6, 924.0)):  # sums of squared binomial coefficients
            change = np.concatenate([np.diff(one[:, c], order) for one in values if len(one) > order] or [np.zeros(0)])
            change = np.abs(change[change != 0.0])
            sizes.append(float(np.quantile(change, 0.3)) / np.sqrt(gain) if len(change) else 0.0)
        if not sizes[0] or not WHITE[0] < sizes[1] / sizes[0] < WHITE[1]:
            return False
    return True


def _moving(value: Floats, level: Level) -> Bools:
    """(F,) samples of (F, C) around which it moves by more than the noise, whatever is repeated."""
    window = 7
    if len(value) < window:
        return np.zeros(len(value), bool)
    views = np.lib.stride_tricks.sliding_window_view(value, window, axis=0)
    moves = (np.ptp(views, axis=-1) > level.apart).any(axis=1)
    return np.pad(moves, (window // 2, window // 2), mode="edge")


def _first_of_each(track: Track) -> Track:
    keep: Ints = np.flatnonzero(~_same(track.value))
    std = None if track.std is None else track.std[keep]
    return replace(track, stamp_ns=track.stamp_ns[keep], value=track.value[keep], std=std)

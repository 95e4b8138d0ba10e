"""Values that stop changing while what is measured does not.

Three signs, each of its own kind. Where it moves steadily before and after, and jumps afterwards to where it would have
been: the sensor froze, or lost its messages. Where it scatters by noise everywhere else, to the last bit of no number:
nothing measures that still. Where every value of a noisy motion is said several times: messages are more frequent than
measurements, and all but the first of each are late.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from compass_ros.checks.finding import Finding, told
from compass_ros.checks.series import Level, Series
from compass_ros.types import Bools, Floats, Ints

SHORTEST = 3
"""Equal samples in a row from which a value counts as frozen: an encoder says one twice in every slow motion."""
STEADY = 0.5
"""Share by which two steps, or a jump and what the speed makes of the time, may differ and be alike."""
SILENT = 6
"""Equal samples in a row that noise never gives: of two numbers in 10^4 that are equal by rounding, 10^-20."""
HELD = 0.2
"""Share of the samples of a motion that repeat the one before from which messages are too frequent."""
WHITE = (0.6, 1.6)
"""Noise by sixth differences over that by fourth: one for white noise; a motion shows a tenth and less."""


@dataclass(frozen=True)
class Thawed:
    """The recordings without repeated values, and what was found."""

    series: tuple[Series, ...]
    findings: tuple[Finding, ...]


def frozen(series: Sequence[Series], level: Level) -> Thawed:
    """What is frozen or held in the recordings of one signal."""
    held = _held(series, level)
    noisy = not level.step.any() and _white([one.value for one in series])
    stuck: dict[str, tuple[int, ...]] = {}
    for one in series:
        runs = _runs(one.value)
        which = [r for r in runs if _caught_up(one, r, level) or (noisy and not held and r[1] - r[0] + 1 >= SILENT)]
        stuck |= {one.recording: told(np.concatenate([np.arange(a, b + 1) for a, b in which]))} if which else {}
    looks = "the value stays the same to the last bit while it should move or scatter: frozen"
    found = [Finding("frozen", "bad", series[0].signal, stuck, looks)] if stuck else []
    if not held:
        return Thawed(tuple(series), tuple(found))
    times = float(np.median([_times(one) for one in series if one.recording in held]))
    looks = f"each value is said about {times:.0f} times, the messages are more frequent than it: repeats left out"
    found.append(Finding("held", "repaired", series[0].signal, held, looks))
    return Thawed(tuple(_first_of_each(one) if one.recording in held else one for one in series), tuple(found))


def _same(value: Floats) -> Bools:
    """(F,) whether a sample repeats the one before."""
    return np.concatenate([[False], (value[1:] == value[:-1]).all(axis=1)])


def _runs(value: Floats) -> list[tuple[int, int]]:
    """First and last index of each row of SHORTEST equal samples or more."""
    start = np.flatnonzero(~_same(value))
    end = np.append(start[1:], len(value)) - 1
    return [(int(a), int(b)) for a, b in zip(start, end, strict=True) if b - a + 1 >= SHORTEST]


def _caught_up(one: Series, run: tuple[int, int], level: Level) -> bool:
    """Whether it moves steadily before and after, and what it makes up for at once is what that speed makes."""
    first, last = run
    if first < 2 or last + 3 >= len(one.value):
        return False
    scaled, time = one.value / level.apart, one.time_s
    speed = np.diff(scaled[[first - 2, first - 1, first]], axis=0) / np.diff(time[first - 2 : first + 1])[:, None]
    later = np.diff(scaled[last + 1 : last + 4], axis=0) / np.diff(time[last + 1 : last + 4])[:, None]
    jump = scaled[last + 1] - scaled[last]
    expected = (speed.mean(axis=0) + later.mean(axis=0)) / 2 * (time[last + 1] - time[first])
    steady = _alike(speed[0], speed[1]) and _alike(later[0], later[1])
    return steady and bool(np.linalg.norm(jump) > 1) and _alike(jump, expected)


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


def _held(series: Sequence[Series], level: Level) -> dict[str, tuple[int, ...]]:
    """Recordings in which the values of a motion are repeated; no encoder says them."""
    if level.step.any():
        return {}
    out: dict[str, tuple[int, ...]] = {}
    for one in series:
        moving, same = _moving(one, level), _same(one.value)
        if np.sum(moving) >= 20 and np.mean(same[moving]) > HELD:
            out[one.recording] = ()
    return out


def _moving(one: Series, level: Level) -> Bools:
    """(F,) samples around which it moves by more than the noise, whatever is repeated."""
    window = 7
    if len(one.value) < window:
        return np.zeros(len(one.value), bool)
    views = np.lib.stride_tricks.sliding_window_view(one.value, window, axis=0)
    moves = (np.ptp(views, axis=-1) > level.apart).any(axis=1)
    return np.pad(moves, (window // 2, window // 2), mode="edge")


def _times(one: Series) -> float:
    return len(one.value) / float(np.sum(~_same(one.value)))


def _first_of_each(one: Series) -> Series:
    keep: Ints = np.flatnonzero(~_same(one.value))
    return replace(one, stamp_ns=one.stamp_ns[keep], value=one.value[keep])

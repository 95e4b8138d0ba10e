"""When the motion begins, in a recording that begins before it.

A body that is held, or that nobody has pushed yet, says nothing of the physics of its motion, and a simulator that is
started there lets go of it too early. A body that starts from rest with the recording is something else: it moves as a
parabola from the first sample on.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from compass_ros.checks.series import SIGMAS, Level, Series
from compass_ros.types import Floats

LASTING = 3
"""Samples in a row away from rest that are motion: an outlier is one, or two."""
SURE = 25.0
"""Fall of chi-square by one more number, the moment of release, from which it is there: five standard deviations."""
AROUND = 60
"""Samples before the first motion in which the moment is looked for, in twice as many where it is not among them."""


def first_motion(series: Sequence[Series], levels: Sequence[Level]) -> int | None:
    """Stamp [ns] of the first sample from which some signal of one recording moves; None: nothing does."""
    moments = [_stamp(one, level) for one, level in zip(series, levels, strict=True)]
    return min((moment for moment in moments if moment is not None), default=None)


def _stamp(one: Series, level: Level) -> int | None:
    leaves = leaving(one.value, level)
    return None if leaves is None else int(one.stamp_ns[_release(one, level, leaves)])


def leaving(value: Floats, level: Level) -> int | None:
    """Index of the first of (F, C) samples that is away from the first ones for good; None where none is."""
    first = np.median(value[:5], axis=0)
    away = (np.abs(value - first) > np.maximum(SIGMAS * level.noise, 2 * level.expected)).any(axis=1)
    lasting = np.convolve(away, np.ones(LASTING), mode="valid") == LASTING
    return int(np.argmax(lasting)) if lasting.any() else None


def _release(one: Series, level: Level, leaves: int) -> int:
    """Index of the sample at which a still lead ends; 0 where there is none."""
    if leaves < LASTING:
        return 0
    around = AROUND
    while True:
        begin, end = max(leaves - around, 0), min(leaves + max(around // 4, LASTING), len(one.value))
        best, sure = _hinge(one, level, begin, leaves, end)
        if begin == 0 or best > around // 4:
            return begin + best if sure and begin + best >= LASTING else 0
        around *= 2


def _hinge(one: Series, level: Level, begin: int, leaves: int, end: int) -> tuple[int, bool]:
    """Where in the samples from `begin` rest turns into motion, and whether it surely does so after the first."""
    scaled = one.value[begin:end] / level.noise
    column = int(np.argmax(np.ptp(scaled, axis=0)))
    time, value, lead = one.time_s[begin:end] - one.time_s[begin], scaled[:, column], leaves - begin
    near = np.abs(value - np.median(value[:lead])) < _reach(one, level, column)
    near[: lead + LASTING] = True
    left = np.array([_misfit(time[near], value[near], moment) for moment in time[: lead + 1]])
    best = int(np.argmin(left))
    return best, bool(left[0] - left[best] > SURE)


def _reach(one: Series, level: Level, column: int) -> float:
    """How far a motion follows a parabola, in standard deviations.

    A swing of size A that has moved by d is off it by d^2 / 6 A; half of where that is one standard deviation.
    """
    size = float(np.ptp(one.value[:, column])) / float(level.noise[column])
    return max(10.0, 0.5 * float(np.sqrt(6 * size)))


def _misfit(time: Floats, value: Floats, moment: float) -> float:
    """Sum of squares that is left by rest until a moment and a parabola from there on."""
    since = np.maximum(time - moment, 0.0)
    design = np.stack([np.ones_like(time), since, since**2], axis=1)
    return float(np.sum((value - design @ np.linalg.lstsq(design, value, rcond=None)[0]) ** 2))

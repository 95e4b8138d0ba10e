"""Stamps against the motion: a clock that jumps leaves a gap in time and none in the motion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from compass_ros.checks.finding import Finding
from compass_ros.checks.series import Series

GAP = 1.8
"""Usual periods from which the time between two samples is a gap: one sample is missing, or the clock has jumped."""
ALIKE = 0.5
"""Share by which the speeds before and after a gap may differ and it is the same motion."""


def gaps(one: Series) -> list[int]:
    """Indices of samples that come late."""
    return [int(i) + 1 for i in np.flatnonzero(np.diff(one.time_s) > GAP * one.period_s)]


def jumping_clock(series: Sequence[Series]) -> tuple[Finding, ...]:
    """Recordings whose stamps jump while the motion goes on as if no time had passed.

    `series`: all numbers of a signal, each in units that tell two values apart. They share the stamps, so all of them
    must show the jump: of one joint among seven that turns round in a gap nothing follows. Nor does it from one gap
    among many of its length, in which time did pass: where frames are lost all the time, now and then a motion stops.
    """
    late = [(one, i, one.time_s[i] - one.time_s[i - 1]) for one in series for i in gaps(one)]
    lengths = np.array([length for _, _, length in late])
    still = np.array([_no_time_passed(one, i) for one, i, _ in late], bool)
    samples: dict[str, tuple[int, ...]] = {}
    longest = 0.0
    for (one, i, length), jumped in zip(late, still, strict=True):
        if jumped and np.mean(still[lengths > 0.5 * length]) > 0.5:
            samples[one.recording] = (*samples.get(one.recording, ()), i)
            longest = max(longest, float(length - one.period_s))
    looks = f"the stamps jump (by up to {longest:.3g} s) and the motion does not"
    return (Finding("clock", "bad", series[0].signal, samples, looks),) if samples else ()


def _no_time_passed(one: Series, late: int) -> bool:
    """Whether the sample is where it would be one period after the one before, and not where the stamps say.

    By the speeds before and after, which must be alike and make a difference that the noise does not conceal.
    """
    if late < 3 or late + 2 >= len(one.value):
        return False
    scaled, time = one.value, one.time_s
    before = (scaled[late - 1] - scaled[late - 3]) / (time[late - 1] - time[late - 3])
    after = (scaled[late + 2] - scaled[late]) / (time[late + 2] - time[late])
    if np.linalg.norm(before - after) > ALIKE * max(np.linalg.norm(before), np.linalg.norm(after)):
        return False
    speed, gap = (before + after) / 2, time[late] - time[late - 1]
    moved, at_once = scaled[late] - scaled[late - 1], speed * one.period_s
    off = np.linalg.norm(moved - at_once)
    visible = np.linalg.norm(speed) * (gap - one.period_s) > 1
    return bool(visible and off < 0.5 * np.linalg.norm(moved - speed * gap) and off < 1 + np.linalg.norm(at_once))

"""Angles that are reported within one turn: they jump by 2 pi where the joint goes on turning.

Between two samples less than a quarter turn was made, or it could have been made the other way round: with that, and
with a range of the joint that the whole way fits into, there is one way only, and the jumps are surely mended.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from compass_ros.checks.finding import Finding, told
from compass_ros.checks.series import Level, Series
from compass_ros.types import Floats, Ints

TURN = 2 * np.pi


@dataclass(frozen=True)
class Unwrapped:
    """The recordings of a joint without jumps, and what was found."""

    series: tuple[Series, ...]
    findings: tuple[Finding, ...]


def unwrapped(series: Sequence[Series], level: Level) -> Unwrapped:
    """Angles [rad] of all recordings of one joint as they went on; those of another kind as they are."""
    if series[0].kind != "angle":
        return Unwrapped(tuple(series), ())
    jumps = {one.recording: _jumps(one) for one in series}
    out, mended, shifted, doubtful = [], {}, {}, {}
    for one in series:
        whole = np.unwrap(one.value[:, 0])
        turns = _turns(whole, one, level)
        at = jumps[one.recording]
        if turns is None or not _sure(one, whole):
            doubtful.update({one.recording: told(at)} if len(at) else {})
            out.append(one)
            continue
        mended.update({one.recording: told(at)} if len(at) else {})
        shifted.update({one.recording: ()} if turns and not len(at) else {})
        out.append(replace(one, value=(whole + TURN * turns)[:, None]) if len(at) or turns else one)
    signal = series[0].signal
    found = (
        Finding("wrapped", "repaired", signal, mended, "the angle jumps by 2 pi and goes on (wrapped): unwrapped"),
        Finding("turns", "repaired", signal, shifted, "the angle is whole turns outside the joint's range: brought in"),
        Finding("jumps", "bad", signal, doubtful, "the angle jumps by about a turn, and which way it went is not sure"),
    )
    return Unwrapped(tuple(out), tuple(one for one in found if one.samples))


def _jumps(one: Series) -> Ints:
    """Indices of samples that are more than half a turn from the one before."""
    return np.flatnonzero(np.abs(np.diff(one.value[:, 0])) > np.pi) + 1


def _sure(one: Series, whole: Floats) -> bool:
    """Whether no step is a quarter turn, and what was reported stays within one turn."""
    within = np.ptp(one.value) <= TURN * (1 + 1e-3)
    return bool(within and (len(whole) < 2 or np.abs(np.diff(whole)).max() < TURN / 4))


def _turns(whole: Floats, one: Series, level: Level) -> int | None:
    """Turns to add so that the whole way is in the joint's range; None where it does not fit in."""
    margin = float(level.apart[0])
    if one.low - margin <= whole.min() and whole.max() <= one.high + margin:
        return 0
    turns = int(np.ceil((one.low - margin - whole.min()) / TURN))
    return turns if whole.max() + TURN * turns <= one.high + margin else None

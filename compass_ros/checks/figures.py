"""What there is to know of each signal before a fit: how often, how finely, how still, and how much of it is used."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from compass_ros.cells import Cell
from compass_ros.checks.check import Checked
from compass_ros.checks.delay import Command, delay, given
from compass_ros.checks.onset import leaving
from compass_ros.checks.series import Level, Series
from compass_ros.checks.signals import Looked
from compass_ros.checks.stamps import gaps
from compass_ros.simulation.replay import STILL_S
from compass_ros.types import Bools, Episode

_NS = 1e-9
_WINDOW = 7
"""Samples in which it is still where all of them are within the noise."""
AT_LIMIT = 3
"""Samples in a row at the range of a joint, or at the largest value of all, from which it is stuck there."""
MOST = 4000
"""Samples of a recording in which a delay is looked for."""


@dataclass(frozen=True)
class Figures:
    """Of one signal over all recordings. Shares are of 1."""

    signal: str
    unit: str
    recordings: int
    samples: int
    rate_hz: float
    """Median over the recordings."""
    gaps: int
    """How often a sample is late by more than 0.8 periods."""
    noise: float
    """Standard deviation of a sample [unit], the largest of its numbers."""
    step: float
    """Of its encoder [unit]; 0: none found."""
    still: float
    """Share of the samples around which it does not move."""
    saturated: float
    """Share of the samples at which it is stuck at a limit."""
    used: float
    """Share of the samples that the cell compares with its simulator."""
    delay_s: float
    """From the commands to the motion that is most like them, by correlation; from constant ones until it moves. NaN
    where there are none, or none like it."""


def figures(cell: Cell, checked: Checked) -> tuple[Figures, ...]:
    """One row for each part of a signal that says where something is."""
    commands = given(cell, checked.recordings)
    parts = [part for signal in checked.signals.values() for part in signal.parts]
    return tuple(_figures(cell, checked.recordings, commands, part) for part in parts)


def _figures(cell: Cell, episodes: Mapping[str, Episode], commands: Mapping[str, Command], looked: Looked) -> Figures:
    known, total = looked.level, max(sum(len(one.value) for one in looked.series), 1)
    known_to_cell = [(one, episodes[one.recording]) for one in looked.series if one.recording in episodes]
    delays = [_delay(commands[one.recording], one, e, known) for one, e in known_to_cell if one.recording in commands]
    found = [value for value in delays if not np.isnan(value)]
    return Figures(
        signal=looked.part.name,
        unit="" if looked.part.turns else {"angle": "rad", "length": "m"}[looked.part.limits.kind],
        recordings=len(looked.series),
        samples=total,
        rate_hz=float(np.median([1 / one.period_s for one in looked.series])),
        gaps=sum(len(gaps(one)) for one in looked.series),
        noise=float(known.noise.max()),
        step=float(known.step.max()),
        still=sum(int(np.sum(_still(one, known))) for one in looked.series) / total,
        saturated=sum(int(np.sum(_stuck(one, looked.series))) for one in looked.series) / total,
        used=sum(int(np.sum(_used(cell, e, one))) for one, e in known_to_cell) / total,
        delay_s=float(np.median(found)) if 2 * len(found) > len(delays) else float("nan"),
    )


def _delay(command: Command, one: Series, episode: Episode, known: Level) -> float:
    """The signal behind its commands [s]; where they are constant, from the first one until it moves."""
    since = (one.stamp_ns - episode.start_ns) * _NS
    begin, end = max(float(since[0]), float(command.time_s[0])), min(float(since[-1]), float(command.time_s[-1]))
    inside = (since >= begin) & (since <= end)
    if np.sum(inside) < _WINDOW:
        return float("nan")
    if not np.ptp(command.value, axis=0).any():
        leaves = leaving(one.value[inside], known)
        return float("nan") if leaves is None else float(since[inside][leaves]) - float(command.time_s[0])
    grid = np.arange(begin, end, max(one.period_s, (end - begin) / MOST))
    measured = np.stack([np.interp(grid, since, column) for column in one.value.T], axis=1)
    return delay(command.at(grid), measured, float(grid[1] - grid[0]))


def _used(cell: Cell, episode: Episode, one: Series) -> Bools:
    """(F,) what is in the window of the cell; of recordings that are cut into windows all."""
    since = (one.stamp_ns - episode.start_ns) * _NS
    inside = (since >= -STILL_S) & (since <= cell.duration)
    return np.ones(len(since), bool) if cell.spec.windows else inside


def _still(one: Series, known: Level) -> Bools:
    if len(one.value) < _WINDOW:
        return np.zeros(len(one.value), bool)
    views = np.lib.stride_tricks.sliding_window_view(one.value, _WINDOW, axis=0)
    still = (np.ptp(views, axis=-1) <= known.apart).all(axis=1)
    return np.pad(still, (_WINDOW // 2, _WINDOW // 2), mode="edge")


def _stuck(one: Series, series: Sequence[Series]) -> Bools:
    """(F,) samples in a row at the range of the joint, or at the very largest or smallest value of all recordings.

    Noise is at its largest value once; what is cut off there is so again and again.
    """
    value = one.value[:, 0]
    largest, smallest = max(s.value[:, 0].max() for s in series), min(s.value[:, 0].min() for s in series)
    out = np.zeros(len(value), bool)
    for at in (value >= min(one.high, largest), value <= max(one.low, smallest)):
        run = np.flatnonzero(np.diff(np.concatenate([[0], at.astype(int), [0]])))
        for first, last in zip(run[::2], run[1::2], strict=True):
            out[first:last] |= last - first >= AT_LIMIT
    return out

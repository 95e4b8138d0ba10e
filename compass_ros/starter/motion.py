"""Which of two series follows the other, by how much later: the cross-correlation of a command and what came of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from compass_ros.types import Floats, Ints

LATEST_S = 1.0
"""Lags that are looked for, both ways: closed loops of robots answer within a second [s]."""
_LONGEST = 60_000
"""Points of the common grid."""
_NS = 1e-9


@dataclass(frozen=True)
class Lag:
    """How a series follows another."""

    seconds: float
    """By how much later; negative: it leads."""
    correlation: float
    """At that lag; 0 where one of them does not move."""


@dataclass(frozen=True)
class Column:
    """One number of a series in one recording."""

    stamp_ns: Ints
    value: Floats

    def at(self, stamp_ns: Ints, held: bool) -> Floats:
        """(n,) at these times: the last value, or on the line between two."""
        if held:
            before = np.clip(np.searchsorted(self.stamp_ns, stamp_ns, side="right") - 1, 0, None)
            return np.asarray(self.value[before])
        return np.interp((stamp_ns - self.stamp_ns[0]) * _NS, (self.stamp_ns - self.stamp_ns[0]) * _NS, self.value)


def period(column: Column) -> float:
    """Seconds between two values: the median."""
    return float(np.median(np.diff(column.stamp_ns))) * _NS if len(column.stamp_ns) > 1 else LATEST_S


def lag(command: Column, answer: Column, held: bool = True) -> Lag:
    """How an answer follows a command; `held`: the command holds between its stamps.

    Both on one grid as fine as the finer of them, without their means. Long recordings: their first part.
    """
    fine = max(min(period(command), period(answer)), 1e-3)
    begin = max(command.stamp_ns[0], answer.stamp_ns[0])
    count = min(int((min(command.stamp_ns[-1], answer.stamp_ns[-1]) - begin) * _NS / fine), _LONGEST)
    most = int(LATEST_S / fine)
    if count < 4 * most:
        most = count // 4
    if most < 2:
        return Lag(0.0, 0.0)
    grid = begin + np.round(np.arange(count) * fine / _NS).astype(np.int64)
    lead, follow = command.at(grid, held), answer.at(grid, False)
    scores = _scores(lead, follow, most)
    best = int(np.argmax(scores))
    return Lag((best - most + _vertex(scores, best)) * fine, float(scores[best]))


def _scores(lead: Floats, follow: Floats, most: int) -> Floats:
    """(2 most + 1,) correlation of follow[t + k] with lead[t] for k from -most to most.

    The middle of lead alone counts, so that each lag compares the same stretch of it.
    """
    middle = lead[most:-most] - lead[most:-most].mean()
    if not np.any(middle):
        return np.zeros(2 * most + 1)
    size = len(middle)
    # The same as np.correlate, in n log n steps.
    length = 1 << (len(follow) + size).bit_length()
    product = np.fft.irfft(np.fft.rfft(follow, length) * np.conj(np.fft.rfft(middle, length)), length)[: 2 * most + 1]
    sums, squares = (np.concatenate([[0.0], np.cumsum(v)]) for v in (follow, follow**2))
    first = np.arange(2 * most + 1)
    mean = (sums[first + size] - sums[first]) / size
    spread = np.sqrt(np.maximum((squares[first + size] - squares[first]) / size - mean**2, 0.0))
    scale = spread * np.sqrt(np.mean(middle**2)) * size
    return np.asarray(np.divide(product, scale, out=np.zeros_like(scale), where=scale > 1e-12 * (1 + abs(mean))))


def _vertex(scores: Floats, best: int) -> float:
    """Where a parabola through the best score and its neighbours is highest, in steps from it."""
    if not 0 < best < len(scores) - 1:
        return 0.0
    left, middle, right = scores[best - 1 : best + 2]
    bend = left - 2 * middle + right
    return float(0.5 * (left - right) / bend) if bend < 0 else 0.0

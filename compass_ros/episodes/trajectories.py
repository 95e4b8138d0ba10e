"""Trajectories as what was executed of them: each message replaces what is still to come of those before it."""

from __future__ import annotations

import numpy as np

from compass_ros.episodes.rows import Rows
from compass_ros.episodes.sources import Source
from compass_ros.errors import BagError
from compass_ros.types import Floats, Ints


def executed(source: Source, rows: Rows) -> Rows:
    """The points that came to be, by their stamps, joint by joint: a message names those that it moves.

    Where a message begins, the point that the one before had reached until then stands between them (on the straight
    line between its points, or its last one), as ros2_control's joint trajectory controller goes on from there. So the
    line through all of them (`hold: linear`) is what was asked for at any moment.

    Raises:
        BagError: The points of a message are not in the order of their times.
    """
    series = [_joint(source, rows, column) for column in range(rows.value.shape[1])]
    stamps = np.unique(np.concatenate([stamp for stamp, _ in series]))
    value = np.full((len(stamps), len(series)), np.nan)
    for column, (stamp, own) in enumerate(series):
        value[np.searchsorted(stamps, stamp), column] = own
    nothing = np.zeros(len(stamps))
    return Rows(stamps, stamps, stamps, nothing == 0, value, nothing)


def _joint(source: Source, rows: Rows, column: int) -> tuple[Ints, Floats]:
    """Stamps and values of one joint."""
    known = np.flatnonzero(~np.isnan(rows.value[:, column]))
    stamp, value, log = rows.stamp_ns[known], rows.value[known, column], rows.log_ns[known]
    begin = rows.begin_ns[known]
    new = np.diff(begin, prepend=begin[:1] - 1) != 0
    new |= np.diff(log, prepend=log[:1]) != 0
    stamps: list[int] = []
    values: list[float] = []
    for first, end in zip(np.flatnonzero(new), np.append(np.flatnonzero(new)[1:], len(known)), strict=True):
        points = stamp[first:end]
        if (np.diff(points) <= 0).any():
            where = f"the points of {source.wanted[column]} in the trajectory that begins at {begin[first]} ns"
            raise BagError(f"{source.topic}: stamps out of order: {where}")
        _replace(stamps, values, int(begin[first]), int(points[0]))
        stamps += points.tolist()
        values += value[first:end].tolist()
    return np.array(stamps, np.int64), np.array(values)


def _replace(stamps: list[int], values: list[float], begin: int, first: int) -> None:
    """Take back what is still to come when a message begins, and say how far the one before had come.

    Where the new one jumps, its first point being at its beginning, that is said for the nanosecond before.
    """
    after: tuple[int, float] | None = None
    while stamps and stamps[-1] >= begin:
        after = stamps.pop(), values.pop()
    at = begin if first > begin else begin - 1
    if stamps and after is not None:
        reached = values[-1] + (after[1] - values[-1]) * (at - stamps[-1]) / (after[0] - stamps[-1])
    elif stamps or after is not None:
        reached = values[-1] if after is None else after[1]  # of the first one only its point is known
    else:
        return
    if not stamps or stamps[-1] < at:
        stamps.append(at)
        values.append(reached)

"""Stamps of one recording in one clock: messages without a stamp have only the log's, which may be another one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from compass_ros.episodes.rows import Rows, Stream
from compass_ros.episodes.sources import Source
from compass_ros.types import Ints

APART_S = 1.0
"""Beyond this log and stamps are of different clocks (a simulation's, a robot's since it was switched on) [s]. On one
clock a message is logged within some hundredths; two that are set by NTP differ by less than that."""

Found = Mapping[Source, Mapping[Stream, Rows]]


def on_one_clock(found: Found) -> tuple[Found, list[str]]:
    """Rows whose stamps are of the log's clock moved onto the clock of the others, and what there is to say.

    Where both clocks are the same nothing is moved. Between them goes the straight line from message to message, so a
    simulation's clock may run at any rate.
    """
    every = [rows for streams in found.values() for rows in streams.values()]
    stamped = max(every, key=lambda rows: int(np.sum(rows.stamped)), default=None)
    if stamped is None or not stamped.stamped.any() or all(rows.stamped.all() for rows in every):
        return found, []
    log, begin = stamped.log_ns[stamped.stamped], stamped.begin_ns[stamped.stamped]
    if abs(float(np.median(log - begin))) <= APART_S * 1e9:
        return found, []
    moved = {source: {s: _moved(rows, log, begin) for s, rows in streams.items()} for source, streams in found.items()}
    names = [s.object for s, streams in found.items() if not all(rows.stamped.all() for rows in streams.values())]
    away = float(np.median(log - begin)) * 1e-9
    said = (
        f"{', '.join(names)}: messages without a stamp, whose log time is {away:.3f} s away from the stamps of others"
    )
    return moved, [f"{said}: moved onto their clock"]


def _moved(rows: Rows, log: Ints, begin: Ints) -> Rows:
    """Rows without a stamp of their own, moved by what log and stamps of another topic differ by at that time."""
    if rows.stamped.all():
        return rows
    order = np.argsort(log, kind="stable")
    apart = (begin - log)[order]
    further = np.interp(rows.log_ns - log[order[0]], log[order] - log[order[0]], apart - apart[0])
    shift = np.where(rows.stamped, 0, apart[0] + np.round(further).astype(np.int64))
    return replace(rows, stamp_ns=rows.stamp_ns + shift, begin_ns=rows.begin_ns + shift)

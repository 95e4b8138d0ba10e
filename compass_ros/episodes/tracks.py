"""Rows of a source become tracks: what was not measured left out, frames and publishers told apart, stamps in order."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from compass_ros.episodes.measured import left_out, measured
from compass_ros.episodes.rows import Rows, Stream, chosen, joined
from compass_ros.episodes.sources import Source
from compass_ros.episodes.spatial_messages import plain_frame
from compass_ros.episodes.trajectories import executed
from compass_ros.errors import BagError
from compass_ros.types import Bools, Floats, Track

OFTEN = 2
"""A clock is set back once or twice in a recording; between two publishers with clocks of their own it always is."""


def tracks(
    source: Source, streams: Mapping[Stream, Rows], noted_std: Sequence[float] | None
) -> tuple[list[Track], list[str]]:
    """The tracks of one source, one for each frame it is seen in, the one to use first; and what there is to say.

    Args:
        source: Of what.
        streams: Its rows in the order of their messages; at least one.
        noted_std: Standard deviations that a bag notes beside its messages: one a row, or one for all.

    Raises:
        BagError: The wanted frame is not there, no row was measured, stamps are out of order, or a standard deviation
            is not finite.
    """
    frames: dict[str, dict[str, Rows]] = {}
    for stream, rows in streams.items():
        frames.setdefault(stream.frame, {})[stream.publisher] = rows
    counts = {name: sum(len(rows.stamp_ns) for rows in found.values()) for name, found in frames.items()}
    ordered = sorted(frames, key=lambda name: counts[name], reverse=True)
    if source.frame:
        wanted = plain_frame(source.frame)
        if wanted not in frames:
            where = f"'{wanted}', but in {', '.join(ordered[:12])}{', ...' * (len(ordered) > 12)}"
            raise BagError(f"{source.topic}: {source.object} is not seen in the frame {where}")
        ordered.sort(key=lambda name: name != wanted)
    found, remarks = zip(*(_track(source, name, frames[name], noted_std) for name in ordered), strict=True)
    said = list(remarks[0])
    if len(frames) > 1 and not source.frame:
        listed = ", ".join(f"'{name}' ({counts[name]} messages)" for name in ordered)
        where = f"{source.object} is seen on {source.topic} in {len(frames)} frames, {listed}"
        said.append(f"{where}: only '{ordered[0]}' is used; `frame` in the cell's YAML names another")
    return list(found), said


def _track(
    source: Source, frame: str, publishers: Mapping[str, Rows], noted_std: Sequence[float] | None
) -> tuple[Track, list[str]]:
    """Track of the rows in one frame, and what was left out of it."""
    every = np.concatenate([rows.value for rows in publishers.values()])
    remark = left_out(every, source.quantity, f"messages of {source.object} on {source.topic}")
    kept = {name: _used(source, rows) for name, rows in publishers.items()}
    if not any(len(rows.stamp_ns) for rows in kept.values()):
        unset = source.quantity == "pose" and bool(np.isfinite(every).all())
        hint = "; its positions alone are usable: `quantity: xyz`" if unset else ""
        raise BagError(f"{remark}: nothing is left of {source.object}{hint}")
    own, told = _told_apart(source, kept)
    rows = _gathered(joined(list(own.values()))) if len(own) > 1 else next(iter(own.values()))
    std = _std(rows, source, noted_std)
    track = Track(source.object, source.quantity, rows.stamp_ns, rows.value, std, frame)
    return track, [said for said in (remark, told) if said]


def _used(source: Source, rows: Rows) -> Rows:
    """Rows of one publisher that say something, in the order of their stamps. Raises BagError."""
    rows = chosen(rows, measured(rows.value, source.quantity))
    if not len(rows.stamp_ns):
        return rows
    rows.value[~np.isfinite(rows.value)] = np.nan
    if np.any(rows.begin_ns != rows.stamp_ns):
        return executed(source, rows)
    rows = chosen(rows, ~_repeated(rows))
    if np.all(np.diff(rows.stamp_ns) > 0):
        return rows
    for column in range(rows.value.shape[1]):
        _check_order(source, column, rows)
    return _gathered(rows)


def _repeated(rows: Rows) -> Bools:
    """(n,) whether a row is the one before it, come twice."""
    value, std = rows.value, rows.std
    same = (value[1:] == value[:-1]) | (np.isnan(value[1:]) & np.isnan(value[:-1]))
    stated = (std[1:] == std[:-1]) | (np.isnan(std[1:]) & np.isnan(std[:-1]))
    again = (np.diff(rows.stamp_ns) == 0) & same.all(axis=1) & stated
    return np.concatenate([[False], again])


def _check_order(source: Source, column: int, rows: Rows) -> None:
    """Raises BagError where the stamps of a number do not increase."""
    stamps = rows.stamp_ns[~np.isnan(rows.value[:, column])]
    backwards = np.flatnonzero(np.diff(stamps) <= 0)
    if backwards.size:
        index = int(backwards[0]) + 1
        step = int(stamps[index] - stamps[index - 1])
        how = f"{-step} ns before the one before it" if step else "as is the one before it"
        what = f"message {index + 1} of {source.wanted[column] if source.of else source.object}"
        many = f"; {backwards.size} stamps go back: two publishers on the topic?" if backwards.size > OFTEN else ""
        raise BagError(f"{source.topic}: stamps out of order: {what} is stamped {stamps[index]} ns, {how}{many}")


def _gathered(rows: Rows) -> Rows:
    """Rows by their stamps; those of one stamp, which say different numbers, are one."""
    rows = chosen(rows, np.argsort(rows.stamp_ns, kind="stable"))
    first = np.flatnonzero(np.concatenate([[True], np.diff(rows.stamp_ns) > 0]))
    whole = chosen(rows, first)
    return Rows(
        whole.stamp_ns, whole.begin_ns, whole.log_ns, whole.stamped, np.fmax.reduceat(rows.value, first), whole.std
    )


def _told_apart(source: Source, publishers: Mapping[str, Rows]) -> tuple[dict[str, Rows], str]:
    """Of publishers that say the same number at the same time only the one that says it most often; and a remark."""
    ordered = sorted(publishers, key=lambda name: len(publishers[name].stamp_ns), reverse=True)
    own: dict[str, Rows] = {}
    lost: list[str] = []
    for name in ordered:
        rows = publishers[name]
        value = rows.value.copy()
        for column in range(value.shape[1]):
            if any(_overlap(rows, other, column) for other in own.values()):
                value[:, column] = np.nan
        if not np.array_equal(value, rows.value, equal_nan=True):
            lost.append(name)
            rows = chosen(
                Rows(rows.stamp_ns, rows.begin_ns, rows.log_ns, rows.stamped, value, rows.std),
                ~np.isnan(value).all(axis=1),
            )
        if len(rows.stamp_ns):
            own[name] = rows
    if not lost:
        return own, ""
    both = f"{source.object} on {source.topic} comes from several publishers at once"
    return own, f"{both}: only the one with most messages is used, and not {_listed(lost, publishers)}"


def _listed(names: Sequence[str], publishers: Mapping[str, Rows]) -> str:
    return ", ".join(f"'{name.strip()}' ({len(publishers[name].stamp_ns)} messages)" for name in names)


def _overlap(one: Rows, other: Rows, column: int) -> bool:
    """Whether two publishers say a number in the same stretch of time."""
    a, b = (rows.stamp_ns[~np.isnan(rows.value[:, column])] for rows in (one, other))
    return bool(len(a) and len(b) and a[0] <= b[-1] and b[0] <= a[-1])


def _std(rows: Rows, source: Source, noted: Sequence[float] | None) -> Floats | None:
    if np.any(rows.std == 0):
        if noted is None:
            return None
        return np.array(noted if len(noted) == len(rows.std) else [noted[0]] * len(rows.std), float)
    bad = np.flatnonzero(~np.isfinite(rows.std))
    if bad.size:
        which = f"message {bad[0] + 1} ({bad.size} of {len(rows.std)} messages): {rows.std[bad[0]]}"
        raise BagError(f"{source.topic}: standard deviation of {source.object} is not finite in {which}")
    return rows.std

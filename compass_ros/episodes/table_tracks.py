"""Columns of a table as tracks, inputs and single numbers of an episode."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from compass_ros.episodes.import_config import Numbers, TimeColumn, TrackColumns
from compass_ros.episodes.measured import ONE_BY_ONE, left_out, measured
from compass_ros.episodes.table import Table
from compass_ros.errors import DataError
from compass_ros.types import NUMBERS, QUANTITY_SIZE, Floats, Track

FIRST_STAMP_NS = 10**9
"""Stamp of time 0 of a table: one second, because a stamp of 0 means `not set` in ROS."""


def time_of(time: TimeColumn, table: Table) -> Floats:
    """(F,) seconds since the first row, increasing; NaN where a row does not say."""
    if time.column == "":
        if not time.rate_hz:
            raise DataError("time: expected a column or a rate_hz")
        return np.arange(table.rows) / time.rate_hz
    since = table.seconds(time.column, time.unit_s, "time")
    if time.nanosec != "":
        rest = table.column(time.nanosec, "time.nanosec")
        since = since + (rest - rest[np.isfinite(since)][:1]) * 1e-9
    known = np.flatnonzero(np.isfinite(since))
    if not known.size:
        raise DataError(f"time: column '{time.column}' holds no number")
    back = np.flatnonzero(np.diff(since[known]) <= 0)
    if back.size:
        before, row = known[back[0]], known[back[0] + 1]
        raise DataError(f"time does not increase in {table.place(row)}: {since[before]:g} s, then {since[row]:g} s")
    return since


def track_of(target: str, columns: TrackColumns, time_s: Floats, table: Table, where: str) -> tuple[Track, str]:
    """Track of the rows in which the object was seen, and what there is to say of the others.

    Of joints and scalars a row that lacks some numbers stays, with NaN for them. `where`: `tracks.ball`.
    """
    values = _rows(columns, table, len(time_s), where)
    size = _size(target, columns, where)
    if values.shape[1] != size:
        raise DataError(f"{where}: expected {size} columns for '{columns.quantity}', found {values.shape[1]}")
    timed = np.flatnonzero(np.isfinite(time_s))
    seen = timed[measured(values[timed], columns.quantity)]
    if not seen.size:
        names = ", ".join(str(name) for name in columns.columns if name is not None)
        raise DataError(f"{where}: no row of the columns {names} says where {target} is")
    remark = left_out(
        values[timed], columns.quantity, f"rows of {target}", lambda index: table.place(int(timed[index]))
    )
    stamps = np.asarray(FIRST_STAMP_NS + np.round(time_s[seen] * 1e9), np.int64)
    std = np.full(len(stamps), columns.std) if columns.std else None
    return Track(target, columns.quantity, stamps, values[seen], std), remark


def _size(target: str, columns: TrackColumns, where: str) -> int:
    """Numbers in a row. Raises DataError where the names of joints or numbers are missing or wrong."""
    known = NUMBERS.get(columns.quantity, ())
    wrong = [name for name in columns.of if known and name not in known]
    if wrong:
        raise DataError(f"{where}.of: a {columns.quantity} has no {', '.join(wrong)}; it has {', '.join(known)}")
    if columns.quantity in ONE_BY_ONE and not columns.of:
        raise DataError(f"{where}.of: missing; say a name for each column of {target}")
    return len(columns.of) or QUANTITY_SIZE[columns.quantity]


def first_of(numbers: Numbers, table: Table, rows: int, where: str) -> tuple[float, ...]:
    """The first row without a gap. Raises DataError."""
    values = _rows(numbers, table, rows, where)
    whole = np.flatnonzero(np.isfinite(values).all(axis=1))
    if not whole.size:
        raise DataError(f"{where}: no row has a number in each of its columns")
    return tuple(values[whole[0]].tolist())


def constant_of(numbers: Numbers, table: Table, rows: int, where: str) -> float:
    """The one number of a column. Raises DataError where it varies."""
    values = _rows(numbers, table, rows, where)[:, 0]
    known = np.flatnonzero(np.isfinite(values))
    if not known.size:
        raise DataError(f"{where}: column '{numbers.columns[0]}' holds no number")
    first = known[0]
    other = known[values[known] != values[first]]
    if other.size:
        both = f"{values[first]:g} in {table.place(first)}, {values[other[0]]:g} in {table.place(other[0])}"
        raise DataError(f"{where}: column '{numbers.columns[0]}' varies ({both}); an action is one number a recording")
    return float(values[first])


def _rows(numbers: Numbers, table: Table, rows: int, where: str) -> Floats:
    """(F, columns) SI numbers. Raises DataError that says where in the YAML they are asked for."""
    columns, minus = (_whole(names, table) for names in (numbers.columns, numbers.minus or (None,)))
    scale = np.array(numbers.scale or (1.0,))
    offset = np.array(numbers.offset or (0.0,))
    for name, given in (("scale", scale), ("offset", offset), ("minus", np.array(minus))):
        if len(given) not in (1, len(columns)):
            raise DataError(f"{where}.{name}: expected 1 or {len(columns)} entries, found {len(given)}")
    values = _stack(columns, table, rows, where)
    return np.asarray((values - _stack(minus, table, rows, where)) * scale + offset)


def _whole(names: Sequence[str | int | None], table: Table) -> list[str | int | None]:
    """The same with all columns of an array in place of the array's name."""
    return [one for name in names for one in (table.parts(name) if isinstance(name, str) else (name,))]


def _stack(names: Sequence[str | int | None], table: Table, rows: int, where: str) -> Floats:
    columns = [np.zeros(rows) if name is None else table.column(name, where) for name in names]
    for name, column in zip(names, columns, strict=True):
        if len(column) != rows:
            raise DataError(f"{where}: column '{name}' has {len(column)} rows, the time has {rows}")
    return np.stack(columns, axis=1)

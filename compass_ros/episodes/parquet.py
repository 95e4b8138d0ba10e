"""Parquet files (pandas, polars, LeRobot's datasets), as named columns; read by pyarrow, of the extra `parquet`.

Columns of lists of one length, as LeRobot's `observation.state`, are that many columns: `observation.state.0`, ...
Times of the type `timestamp` are whole nanoseconds since 1970, so `unit_s: 1.0e-9`.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from compass_ros.episodes.raw import one_line
from compass_ros.episodes.table import Table
from compass_ros.errors import DataError, nearest
from compass_ros.types import Floats, Ints

Cells = Sequence[object] | Floats | Ints


def parquet_tables(path: Path, group_by: str) -> list[Table]:
    """The table of a file; several where a column's values part its rows.

    Raises DataError, without the file's name, for what is no Parquet or lacks the column.
    """
    from pyarrow import ArrowException, parquet  # type: ignore[import-untyped]

    try:
        content = parquet.read_table(path)
    except (ArrowException, OSError, ValueError) as error:
        raise DataError(f"cannot be read as Parquet: {one_line(error)}") from error
    if not content.num_rows:
        raise DataError("is empty; expected rows of numbers")
    columns: dict[str, Cells] = {}
    for name, column in zip(content.column_names, content.columns, strict=True):
        columns |= _cells(name, column)
    if not group_by:
        return [_table(path, 1, "1", columns, np.arange(content.num_rows))]
    if group_by not in columns:
        raise DataError(f"group_by: no column '{group_by}'; it has {', '.join(columns)}{nearest(group_by, columns)}")
    groups: dict[str, list[int]] = {}
    for row, value in enumerate(content.column(group_by).to_pylist()):
        groups.setdefault(str(value), []).append(row)
    return [_table(path, i, group, columns, np.array(rows)) for i, (group, rows) in enumerate(groups.items(), 1)]


def _table(path: Path, index: int, group: str, columns: dict[str, Cells], rows: Ints) -> Table:
    labels = {"file": path.stem, "index": str(index), "key": path.stem, "group": group}
    every = list(columns.values())

    def cells(place: int) -> Cells:
        column = every[place]
        return column[rows] if isinstance(column, np.ndarray) else [column[row] for row in rows]

    return Table(labels, [(name,) for name in columns], cells, len(rows), lambda row: f"row {rows[row] + 1}")


def _cells(name: str, column: Any) -> dict[str, Cells]:
    """A column of Arrow by its name, or by the numbers of its lists; what is empty is NaN."""
    import pyarrow as pa

    kind, of = column.type, pa.types
    if of.is_timestamp(kind):
        return {name: _numbers(column.cast(pa.timestamp("ns", kind.tz)).cast(pa.int64()))}
    if any(is_one(kind) for is_one in (of.is_integer, of.is_floating, of.is_decimal, of.is_boolean)):
        return {name: _numbers(column)}
    if any(is_one(kind) for is_one in (of.is_list, of.is_large_list, of.is_fixed_size_list)):
        rows = column.to_pylist()
        width = max((len(row) for row in rows if row), default=0)
        if all(row is None or len(row) == width for row in rows):
            numbers = [[np.nan] * width if row is None else row for row in rows]
            return {f"{name}.{i}": [row[i] for row in numbers] for i in range(width)}
    return {name: column.to_pylist()}


def _numbers(column: Any) -> Floats | Ints:
    """Whole numbers stay whole where none is missing: nanoseconds since 1970 have more digits than a float."""
    if column.null_count:
        return np.array([np.nan if value is None else float(value) for value in column.to_pylist()])
    array = column.to_numpy()
    return np.asarray(array, np.int64) if array.dtype.kind in "iub" else np.asarray(array, float)

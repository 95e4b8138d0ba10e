"""Parquet files (pandas, polars, LeRobot's datasets), as named columns; read by pyarrow, of the extra `parquet`.

Columns of lists of one length, as LeRobot's `observation.state`, are that many columns: `observation.state.0`, ...
Times of the type `timestamp` are whole nanoseconds since 1970, so `unit_s: 1.0e-9`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from compass_ros.episodes.raw import one_line
from compass_ros.episodes.table import Table
from compass_ros.errors import DataError
from compass_ros.types import Floats, Ints


def parquet_tables(path: Path, group_by: str) -> list[Table]:
    """The table of a file; several where a column's values part its rows. Columns become numbers where they are asked.

    Raises DataError, without the file's name, for what is no Parquet or lacks the column.
    """
    from pyarrow import ArrowException, parquet  # type: ignore[import-untyped]  # it has no types of its own

    try:
        content = parquet.read_table(path)
    except (ArrowException, OSError, ValueError) as error:
        raise DataError(f"cannot be read as Parquet: {one_line(error)}") from error
    if not content.num_rows:
        raise DataError("is empty; expected rows of numbers")
    columns = dict(_columns(content))
    whole = _table(path, 1, "1", columns, np.arange(content.num_rows))
    if not group_by:
        return [whole]
    groups: dict[str, list[int]] = {}
    for row, value in enumerate(whole.cells(whole.index(group_by, "group_by"))):
        groups.setdefault(str(value), []).append(row)
    return [_table(path, i, group, columns, np.array(rows)) for i, (group, rows) in enumerate(groups.items(), 1)]


def _table(path: Path, index: int, group: str, columns: dict[str, Any], rows: Ints) -> Table:
    labels = {"file": path.stem, "index": str(index), "key": path.stem, "group": group}
    every = list(columns.values())
    names = [(name,) for name in columns]
    return Table(
        labels, names, lambda place: _cells(every[place].take(rows)), len(rows), lambda r: f"row {rows[r] + 1}"
    )


def _columns(content: Any) -> Iterator[tuple[str, Any]]:
    """Columns of Arrow by their names; of lists of one length one for each number, with that after the name."""
    import pyarrow as pa
    import pyarrow.compute as pc  # type: ignore[import-untyped]

    for name, column in zip(content.column_names, content.columns, strict=True):
        kind, of = column.type, pa.types
        listed = of.is_list(kind) or of.is_large_list(kind) or of.is_fixed_size_list(kind)
        lengths = pc.unique(pc.list_value_length(column.drop_null())).to_pylist() if listed else []
        if len(lengths) == 1:
            yield from ((f"{name}.{i}", pc.list_element(column, i)) for i in range(lengths[0]))
        else:
            yield name, column


def _cells(column: Any) -> Sequence[object] | Floats | Ints:
    """Numbers, or what else there is; what is empty is NaN."""
    import pyarrow as pa

    kind, of = column.type, pa.types
    if of.is_timestamp(kind):
        return _numbers(column.cast(pa.timestamp("ns", kind.tz)).cast(pa.int64()))
    if any(is_one(kind) for is_one in (of.is_integer, of.is_floating, of.is_decimal, of.is_boolean)):
        return _numbers(column)
    return list(column.to_pylist())


def _numbers(column: Any) -> Floats | Ints:
    """Whole numbers stay whole where none is missing: nanoseconds since 1970 have more digits than a float."""
    if column.null_count:
        return np.array([np.nan if value is None else float(value) for value in column.to_pylist()])
    array = column.to_numpy()
    return np.asarray(array, np.int64) if array.dtype.kind in "iub" else np.asarray(array, float)

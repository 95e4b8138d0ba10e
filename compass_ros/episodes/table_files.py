"""Tables of numbers in files (CSV, NPZ, MAT, XLSX), each as named columns."""

from __future__ import annotations

import csv
import zipfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import cast

import numpy as np
import openpyxl  # type: ignore[import-untyped]
import scipy.io
from openpyxl.utils.exceptions import InvalidFileException  # type: ignore[import-untyped]

from compass_ros.errors import DataError, nearest
from compass_ros.types import Floats


@dataclass(frozen=True)
class Table:
    """One table of a file."""

    labels: Mapping[str, str]
    """What tells it from the others of its file, for its name: `index` (from 1), `key`, `group`."""
    columns: Mapping[str, Floats]
    """(F,) by name; columns of arrays are numbered `0`, `1`, ..., after the array's name where there are several."""

    def column(self, name: str, asked: str) -> Floats:
        """Raises DataError with the place where it is asked for and the columns that there are."""
        if name not in self.columns:
            known = ", ".join(list(self.columns)[:20])
            raise DataError(f"{asked}: no column '{name}'; there are {known}{nearest(name, self.columns)}")
        return self.columns[name]


def csv_tables(path: Path, pattern: str, group_by: str) -> Iterator[Table]:
    """The one table of a CSV file with a header line; `group_by` parts it by the values of a column."""
    del pattern  # a CSV file has no parts with names
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            rows = list(csv.reader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise DataError(f"{path}: cannot be read as CSV: {error}") from error
    yield from _parted(path, path.stem, [[cell.strip() for cell in row] for row in rows], group_by)


def xlsx_tables(path: Path, pattern: str, group_by: str) -> Iterator[Table]:
    """The sheets whose name matches `pattern`, each with a header line; `group_by` parts them by a column's values."""
    try:
        with path.open("rb") as file:
            book = openpyxl.load_workbook(file, data_only=True)
    except (OSError, InvalidFileException, zipfile.BadZipFile, KeyError, ValueError) as error:
        raise DataError(f"{path}: cannot be read as an Excel workbook (.xlsx): {error}") from error
    for sheet in book.worksheets:
        if fnmatchcase(sheet.title, pattern):
            yield from _parted(path, sheet.title, [list(row) for row in sheet.iter_rows(values_only=True)], group_by)


def npz_tables(path: Path, pattern: str, group_by: str) -> Iterator[Table]:
    """The 2-D arrays whose name matches `pattern`, one table each, columns numbered."""
    del group_by  # one array, one recording
    try:
        with np.load(path, allow_pickle=False) as arrays:
            keys = [key for key in arrays.files if fnmatchcase(key, pattern)]
            for index, key in enumerate(keys):
                array = np.atleast_2d(np.asarray(arrays[key], float))
                yield Table({"index": str(index + 1), "key": key}, {str(i): c for i, c in enumerate(array.T)})
    except (OSError, ValueError, zipfile.BadZipFile) as error:
        raise DataError(f"{path}: cannot be read as NPZ with arrays of numbers: {error}") from error


def mat_tables(path: Path, pattern: str, group_by: str) -> Iterator[Table]:
    """The cells of cell arrays, one table each. `pattern` names the variables side by side: `time=Time_id state=Y_id`.

    Columns are numbered after the names on the left (`state.0`); the longer side of a cell is taken as its samples.
    """
    del group_by
    wanted = dict(pair.split("=", 1) for pair in pattern.split() if "=" in pair)
    try:
        content = scipy.io.loadmat(str(path), variable_names=list(wanted.values()))
        variables = {name: [np.asarray(cell, float) for cell in np.ravel(content[v])] for name, v in wanted.items()}
    except KeyError as error:
        known = ", ".join(name for name, *_ in scipy.io.whosmat(str(path)))
        raise DataError(f"{path}: no variable {error}; it has {known}") from error
    except (OSError, ValueError, TypeError, IndexError, NotImplementedError, scipy.io.matlab.MatReadError) as error:
        raise DataError(f"{path}: cannot be read as MAT with cells of numbers: {error}") from error
    for index, cells in enumerate(zip(*variables.values(), strict=True)):
        columns: dict[str, Floats] = {}
        for name, cell in zip(variables, cells, strict=True):
            samples = cell if cell.shape[0] >= cell.shape[-1] else cell.T
            columns |= {f"{name}.{i}": column for i, column in enumerate(samples.T)}
        yield Table({"index": str(index + 1), "key": str(index + 1)}, columns)


FORMATS: Mapping[str, Callable[[Path, str, str], Iterator[Table]]] = {
    "csv": csv_tables,
    "xlsx": xlsx_tables,
    "npz": npz_tables,
    "mat": mat_tables,
}


def _parted(path: Path, key: str, rows: Sequence[Sequence[object]], group_by: str) -> Iterator[Table]:
    """Tables of rows below a header; rows without any value are left out."""
    if not rows:
        raise DataError(f"{path}: '{key}' is empty; expected a header line and rows of numbers")
    names = [str(name).strip() for name in rows[0] if name is not None]
    filled = [row for row in rows[1:] if any(cell not in (None, "") for cell in row)]
    for row in filled:
        if any(cell not in (None, "") for cell in row[len(names) :]) or len(row) < len(names):
            raise DataError(f"{path}: '{key}' has {len(names)} columns, but a row with {len(row)}: {list(row)[:12]}")
    if group_by and group_by not in names:
        raise DataError(f"{path}: '{key}' has no column '{group_by}'; it has {', '.join(names)}")
    groups: dict[str, list[Sequence[object]]] = {}
    for row in filled:
        groups.setdefault(str(row[names.index(group_by)]) if group_by else "1", []).append(row)
    for index, (group, members) in enumerate(groups.items()):
        columns = {name: _numbers(path, key, name, (row[i] for row in members)) for i, name in enumerate(names)}
        yield Table({"index": str(index + 1), "key": key, "group": group}, columns)


def _numbers(path: Path, key: str, name: str, cells: Iterable[object]) -> Floats:
    cells = list(cells)
    try:
        return np.array([float(cast(str, cell)) for cell in cells])
    except (TypeError, ValueError) as error:
        raise DataError(f"{path}: column '{name}' of '{key}' holds something else than numbers: {error}") from error

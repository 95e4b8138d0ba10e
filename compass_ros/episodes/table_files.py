"""Tables of numbers in files (CSV, NPZ, MAT, XLSX, Parquet), each as named columns."""

from __future__ import annotations

import re
import struct
import zipfile
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np
import openpyxl  # type: ignore[import-untyped]
import scipy.io
from openpyxl.utils.exceptions import InvalidFileException  # type: ignore[import-untyped]

from compass_ros.episodes.delimited import read_rows
from compass_ros.episodes.parquet import parquet_tables
from compass_ros.episodes.raw import one_line
from compass_ros.episodes.table import Table
from compass_ros.episodes.table_rows import Row, tables_of
from compass_ros.errors import DataError, nearest
from compass_ros.types import Floats, Ints

Samples = Floats | Ints
"""Numbers of an array: whole ones stay whole."""

_DAMAGED = (
    *(OSError, EOFError, ValueError, TypeError, LookupError, OverflowError, MemoryError, RuntimeError),
    *(struct.error, zlib.error, zipfile.BadZipFile),
)
"""What the libraries raise on damaged files of all these kinds; an XML that is none is a SyntaxError."""


@dataclass(frozen=True)
class Selection:
    """Which tables of a file."""

    pattern: str = "*"
    """Sheets, arrays; or variables side by side, `time=T state=Y`."""
    group_by: str = ""
    """Column whose values part the rows of a text file or sheet."""
    header: int | None = None
    """Line of the columns' names in a text file or sheet; 0: there is none; None: it is looked for."""


def csv_tables(path: Path, selection: Selection) -> Iterator[Table]:
    """The table of a text file."""
    rows, thousands = read_rows(path)
    yield from tables_of(rows, path.stem, path.stem, selection.group_by, selection.header, thousands)


def xlsx_tables(path: Path, selection: Selection) -> Iterator[Table]:
    """The sheets whose name matches."""
    try:
        with path.open("rb") as file:
            book = openpyxl.load_workbook(file, data_only=True)
    except (*_DAMAGED, InvalidFileException, SyntaxError, AttributeError) as error:
        raise DataError(f"cannot be read as an Excel workbook (.xlsx): {one_line(error)}") from error
    for sheet in book.worksheets:
        if fnmatchcase(sheet.title, selection.pattern):
            lines = enumerate(sheet.iter_rows(values_only=True), sheet.min_row)
            rows = [Row(line, cells) for line, cells in lines if any(cell not in (None, "") for cell in cells)]
            yield from tables_of(rows, path.stem, sheet.title, selection.group_by, selection.header, thousands=",")


def npz_tables(path: Path, selection: Selection) -> Iterator[Table]:
    """The arrays whose name matches, one table each, columns numbered; or arrays side by side."""
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as arrays:
            if "=" in selection.pattern or len(selection.pattern.split()) > 1:
                yield from _side_by_side(path, arrays, selection.pattern)
                return
            named = {key: arrays[key] for key in arrays.files if fnmatchcase(key, selection.pattern)}
            numbers = {key: array for key, array in named.items() if array.ndim and array.dtype.kind in "biuf"}
            for index, (key, array) in enumerate(numbers.items(), 1):
                columns = {str(i): c for i, c in enumerate(np.reshape(_numbers(array), (len(array), -1)).T)}
                yield _of_arrays(path, index, key, columns)
    except _DAMAGED as error:
        raise DataError(f"cannot be read as NPZ with arrays of numbers: {one_line(error)}") from error


def mat_tables(path: Path, selection: Selection) -> Iterator[Table]:
    """Variables side by side: vectors and matrices make one table, the cells of cell arrays one table each.

    Columns are numbered after the names on the left (`state.0`), or after the variables' own where none are given. The
    side of a matrix that is as long as the vectors beside it, else its longer one, is taken as its samples. Fields of
    structures are named with a point: `time=log.t`.
    """
    try:
        content = {name: value for name, value in scipy.io.loadmat(str(path)).items() if not name.startswith("__")}
        yield from _side_by_side(path, content, selection.pattern)
    except NotImplementedError as error:
        hint = "save it again in MATLAB with the option '-v7': save('FILE.mat', 'VARIABLE', '-v7')"
        raise DataError(f"MAT files of version 7.3 (HDF5) are not read; {hint}") from error
    except (*_DAMAGED, scipy.io.matlab.MatReadError) as error:
        raise DataError(f"cannot be read as MAT with numbers: {one_line(error)}") from error


FORMATS: Mapping[str, Callable[[Path, Selection], Iterator[Table]]] = {
    "csv": csv_tables,
    "xlsx": xlsx_tables,
    "npz": npz_tables,
    "mat": mat_tables,
    "parquet": lambda path, selection: iter(parquet_tables(path, selection.group_by)),
}
"""Each raises DataError without the file's name."""


def _groups(pattern: str, content: Mapping[str, object]) -> tuple[dict[str, dict[str, str]], list[str]]:
    """Variables by what they are called in the YAML, for each recording by its name; and what there is to say.

    Pairs NAME=VARIABLE, or patterns of the variables' own names: one recording without a name (""). With a star in a
    pair's variable, a recording for all that the stars together can stand for.
    """
    words = pattern.split()
    pairs = [tuple(word.split("=", 1)) for word in words if "=" in word]
    starred = {name: _standing(variable, content) for name, variable in pairs if "*" in variable}
    plain = {name: variable for name, variable in pairs if name not in starred}
    own = [name for name in content if any(fnmatchcase(name, word) for word in words if "=" not in word)]
    plain |= {name: name for name in own if np.asarray(content[name]).dtype.kind in "biuf"}
    if not starred:
        return ({"": plain} if plain else {}), []
    every = list(dict.fromkeys(key for found in starred.values() for key in found))
    whole = [key for key in every if all(key in found for found in starred.values())]
    said = [
        f"{key} is left out: no array for {', '.join(name for name, found in starred.items() if key not in found)}"
        for key in every
        if key not in whole
    ]
    return {key: plain | {name: found[key] for name, found in starred.items()} for key in whole}, said


def _standing(variable: str, content: Mapping[str, object]) -> dict[str, str]:
    """What the star in a variable's name can stand for, with the variable that it is then."""
    begin, _, end = variable.partition("*")
    matches = re.compile(f"{re.escape(begin)}(.+){re.escape(end)}")
    return {found[1]: name for name in content if (found := matches.fullmatch(name))}


def _side_by_side(path: Path, content: Mapping[str, object], pattern: str) -> Iterator[Table]:
    """One table for each recording that the variables hold."""
    groups, said = _groups(pattern, content)
    if not groups:
        raise DataError(f"no variables of numbers are asked for; it has {_few(content)}")
    index = 0
    for key, wanted in groups.items():
        recordings = {name: _recordings(content, variable) for name, variable in wanted.items()}
        counts = {name: len(found) for name, found in recordings.items()}
        if len(set(counts.values())) > 1:
            raise DataError(f"the variables hold different numbers of recordings: {counts}")
        for number, arrays in enumerate(zip(*recordings.values(), strict=True), 1):
            index += 1
            several = max(counts.values()) > 1
            label = " ".join(filter(None, (key, str(number) if several else ""))) or path.stem
            yield replace(_of_arrays(path, index, label, _columns(recordings, arrays)), remarks=tuple(said))
            said = []


def _columns(names: Iterable[str], arrays: Sequence[Samples]) -> dict[str, Samples]:
    """The columns of matrices beside each other, each by its own number, and of a single one by its name."""
    length = next((array.size for array in arrays if 1 in array.shape and array.size > 1), 0)
    columns: dict[str, Samples] = {}
    for name, array in zip(names, arrays, strict=True):
        samples = _samples(array, length)
        columns |= {f"{name}.{i}": column for i, column in enumerate(samples.T)}
        if samples.shape[1] == 1:
            columns[name] = samples[:, 0]
    return columns


def _few(names: Iterable[str]) -> str:
    every = [*names]
    return f"{', '.join(every[:20])}{', ...' * (len(every) > 20)}"


def _recordings(content: Mapping[str, object], variable: str) -> list[Samples]:
    """The matrices in a variable: itself, or its cells."""
    first, *fields = [variable] if variable in content else variable.split(".")  # arrays of NPZ may have any name
    if first not in content:
        raise DataError(f"no variable '{variable}'; it has {_few(content)}{nearest(first, content)}")
    value = np.asarray(content[first])
    for field in fields:
        if value.dtype.names is None or field not in value.dtype.names:
            raise DataError(f"no field '{field}' in '{variable}'; it has {', '.join(value.dtype.names or ('none',))}")
        value = value[field]
        value = np.asarray(value.ravel()[0]) if value.size == 1 else value
    return [_matrix(cell, variable) for cell in (np.ravel(value) if value.dtype == object else [value])]


def _numbers(cell: object) -> Samples:
    """Whole numbers stay whole: a time in nanoseconds since 1970 has more digits than a float."""
    array = np.asarray(cell)
    return np.asarray(array, np.int64) if array.dtype.kind in "iu" else np.asarray(array, float)


def _matrix(cell: object, variable: str) -> Samples:
    array = _numbers(cell)
    if array.ndim > 2:
        raise DataError(f"'{variable}' has {array.ndim} dimensions; expected vectors and matrices")
    return array.reshape(-1, 1) if array.ndim < 2 else array


def _samples(array: Samples, length: int) -> Samples:
    """The matrix with its samples as rows."""
    if length in array.shape:
        return array if array.shape[0] == length else array.T
    return array if array.shape[0] >= array.shape[1] else array.T


def _of_arrays(path: Path, index: int, key: str, columns: Mapping[str, Samples]) -> Table:
    labels = {"file": path.stem, "index": str(index), "key": key}
    every: Sequence[Samples] = list(columns.values())
    rows = max((len(column) for column in every), default=0)
    return Table(labels, [(name,) for name in columns], every.__getitem__, rows, lambda row: f"row {row + 1}")

"""Tables of measurements become bags, as a YAML describes them (docs/foreign-bags.md lists its fields)."""

from __future__ import annotations

import os
import unicodedata
from collections.abc import Iterator, Sequence
from dataclasses import field
from fnmatch import fnmatchcase
from pathlib import Path, PurePosixPath
from string import Formatter
from typing import Annotated, Literal

import numpy as np
from pydantic import ConfigDict, Field, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass

from compass_ros.config import read_yaml
from compass_ros.episodes.episode_writer import write_episode
from compass_ros.episodes.measured import left_out, measured
from compass_ros.episodes.names import safe_name
from compass_ros.episodes.table import Table
from compass_ros.episodes.table_files import FORMATS, Selection
from compass_ros.errors import ConfigError, DataError, nearest, shown
from compass_ros.types import QUANTITY_SIZE, Episode, Floats, Quantity, Track

DATA_VARIABLE = "COMPASS_REAL_DATA"
_PROJECT = Path(__file__).parents[2]
_FIRST_STAMP_NS = 10**9
"""Stamp of time 0 of a table: one second, because a stamp of 0 means `not set` in ROS."""

_strict = ConfigDict(extra="forbid")


@dataclass(frozen=True, config=_strict)
class TimeColumn:
    """Where the time of a row comes from: a column, or a rate."""

    column: str | int = ""
    """Numbers, or dates with the time of day (ISO 8601; then `unit_s` is not looked at)."""
    unit_s: Annotated[float, Field(gt=0)] = 1.0
    """Seconds in one unit of the column."""
    nanosec: str | int = ""
    """A column of nanoseconds to add, as in a stamp of ROS."""
    rate_hz: Annotated[float, Field(ge=0)] = 0.0
    """Rows a second, where there is no column."""


@dataclass(frozen=True, config=_strict)
class Numbers:
    """Columns of a table as SI numbers: (column - minus) * scale + offset."""

    columns: tuple[str | int | None, ...]
    """null: zero in every row."""
    minus: tuple[str | int | None, ...] = ()
    """Columns to subtract, e.g. for the angle of one link relative to another."""
    scale: tuple[float, ...] = ()
    """SI units in one unit of the column; empty: 1."""
    offset: tuple[float, ...] = ()


@dataclass(frozen=True, config=_strict)
class TrackColumns(Numbers):
    quantity: Quantity = "xyz"
    std: Annotated[float, Field(ge=0)] = 0.0
    """Standard deviation of one measurement [m or rad]; 0: not stated."""


@dataclass(frozen=True, config=_strict)
class Recordings:
    """Some tables of one file, or of several alike; each becomes a bag."""

    file: Annotated[str, Field(max_length=200)]
    """In the data folder; a pattern, as `throw_*.csv`, stands for all files that match."""
    format: Literal["csv", "xlsx", "npz", "mat"]
    name: str
    """Name of the episode, with {key}, {group}, {index}; `names.safe_name` makes it a folder's."""
    tables: str = "*"
    """npz: pattern of the arrays' names; xlsx: of the sheets' names; mat: variables side by side, `time=T state=Y`."""
    group_by: str = ""
    """csv, xlsx: a column whose values part the rows into recordings."""
    header: Annotated[int, Field(ge=0)] | None = None
    """csv, xlsx: line of the columns' names, 0 where there is none; left out: it is looked for."""


@dataclass(frozen=True, config=_strict)
class ImportConfig:
    """The YAML of an import."""

    cell: str
    recordings: tuple[Recordings, ...]
    time: TimeColumn
    tracks: dict[str, TrackColumns]
    initial_state: dict[str, Numbers] = field(default_factory=dict)
    """By object: from the first row that has them all."""
    action: dict[str, Numbers] = field(default_factory=dict)
    """By name of the action's field: one column, the same number in all rows that have one."""


@dataclass(frozen=True)
class Imported:
    """What became of the tables."""

    bags: tuple[Path, ...]
    said: tuple[str, ...]
    """What was left out, and why; one line each."""


def import_tables(yaml_path: str | Path, out: str | Path, data: str | Path | None = None) -> Imported:
    """Write one bag into the folder `out` for every recording that a YAML describes.

    The files are looked for in `data`; without it in the folder named by COMPASS_REAL_DATA, beside the YAML, and in
    `../shared/data` from the project's root. A recording that does not hold what the YAML says costs none of the
    others: it is left out and said.

    Raises:
        ConfigError: The YAML is wrong. DataError: a file is missing, or none holds what the YAML says.
        BagError: A bag exists already or cannot be written.
    """
    path = Path(yaml_path)
    config = _config(path)
    roots = [Path(data)] if data is not None else _roots(path)
    episodes: list[Episode] = []
    refused: list[DataError] = []
    for recordings in config.recordings:
        for found in _episodes(config, recordings, _find(recordings.file, roots, path)):
            if isinstance(found, Episode):
                episodes.append(found)
            else:
                refused.append(found)
    if refused and not episodes:
        raise refused[0]
    bags = tuple(write_episode(episode, out) for episode in episodes)
    remarks = (f"{episode.name}: {remark}" for episode in episodes for remark in episode.remarks)
    return Imported(bags, (*(f"left out: {error}" for error in refused), *remarks))


def _config(path: Path) -> ImportConfig:
    try:
        return TypeAdapter(ImportConfig).validate_python(dict(read_yaml(path)))
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        hint = nearest(str(first["loc"][-1]), ImportConfig.__dataclass_fields__)
        hint = hint if first["type"] == "unexpected_keyword_argument" else ""
        raise ConfigError(f"{path}: {where}: {first['msg']}, found {shown(first['input'])}{hint}") from error


def _roots(path: Path) -> list[Path]:
    named = os.environ.get(DATA_VARIABLE)
    return [*([Path(named)] if named else []), path.parent, _PROJECT.parent / "shared" / "data"]


def _find(name: str, roots: Sequence[Path], path: Path) -> list[Path]:
    """The files of the first folder that has any."""
    pure = PurePosixPath(unicodedata.normalize("NFC", name))
    if pure.is_absolute() or ".." in pure.parts:
        raise ConfigError(f"{path}: file '{name}': expected a path inside the data folder")
    for root in roots:
        if (root / name).is_file():
            return [root / name]
        folder = root / pure.parent
        files = folder.iterdir() if folder.is_dir() else ()
        found = [f for f in files if fnmatchcase(unicodedata.normalize("NFC", f.name), pure.name)]
        if found:
            return sorted(found)
    looked = " or ".join(str(root) for root in roots)
    raise DataError(f"{path}: no file {name} in {looked}; name its folder with --data or {DATA_VARIABLE}")


def _episodes(config: ImportConfig, recordings: Recordings, files: Sequence[Path]) -> list[Episode | DataError]:
    """An episode for each table, or why there is none. Raises ConfigError where two get one name, or none matches."""
    found = [item for file in files for item in _of_file(config, recordings, file)]
    names = [episode.name for episode in found if isinstance(episode, Episode)]
    where = files[0] if len(files) == 1 else files[0].parent / recordings.file
    if not found:
        raise DataError(f"{where}: no table matches '{recordings.tables}'")
    twice = [name for i, name in enumerate(names) if name in names[:i]]
    if twice:
        raise ConfigError(f"{where}: '{recordings.name}' gives the same name to several recordings, e.g. {twice[0]}")
    return found


def _of_file(config: ImportConfig, recordings: Recordings, file: Path) -> Iterator[Episode | DataError]:
    selection = Selection(recordings.tables, recordings.group_by, recordings.header)
    try:
        for table in FORMATS[recordings.format](file, selection):
            name = safe_name(_filled(recordings.name, table))
            try:
                yield _episode(config, table, name)
            except DataError as error:
                where = str(file) if name == file.stem else f"{file}: {name}"
                yield DataError(f"{where}: {error}")
    except DataError as error:
        yield DataError(f"{file}: {error}")


def _episode(config: ImportConfig, table: Table, name: str) -> Episode:
    time_s = _time(config.time, table)
    made = [_track(target, columns, time_s, table) for target, columns in config.tracks.items()]
    tracks = tuple(track for track, _ in made)
    said = [*table.remarks, *(remark for _, remark in made if remark)]
    untimed = int(np.sum(~np.isfinite(time_s)))
    if untimed:
        said.append(f"{untimed} of {len(time_s)} rows have no time and are left out")
    initial = {
        target: tuple(_first(_rows(columns, table, len(time_s), f"initial_state.{target}"), f"initial_state.{target}"))
        for target, columns in config.initial_state.items()
    }
    action = {
        target: _constant(columns, table, len(time_s), f"action.{target}") for target, columns in config.action.items()
    }
    start_ns = min((int(track.stamp_ns[0]) for track in tracks), default=_FIRST_STAMP_NS)
    return Episode(name, config.cell, "", action, start_ns, tracks, initial, remarks=tuple(said))


def _filled(template: str, table: Table) -> str:
    """A name with its labels put in. Raises ConfigError for anything in braces that is not a label."""
    try:
        fields = {name for _, name, _, _ in Formatter().parse(template) if name is not None}
        if fields <= table.labels.keys():
            return template.format(**table.labels)
    except ValueError as error:
        raise ConfigError(f"name '{template}': {error}") from error
    raise ConfigError(f"name '{template}': expected only {', '.join(f'{{{label}}}' for label in table.labels)}")


def _time(time: TimeColumn, table: Table) -> Floats:
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


def _track(target: str, columns: TrackColumns, time_s: Floats, table: Table) -> tuple[Track, str]:
    """Track of the rows in which the object was seen, and what there is to say of the others."""
    size = QUANTITY_SIZE[columns.quantity]
    if len(columns.columns) != size:
        raise DataError(f"{target}: expected {size} columns for '{columns.quantity}', found {len(columns.columns)}")
    values = _rows(columns, table, len(time_s), f"tracks.{target}")
    timed = np.flatnonzero(np.isfinite(time_s))
    seen = timed[measured(values[timed], columns.quantity)]
    if not seen.size:
        names = ", ".join(str(name) for name in columns.columns if name is not None)
        raise DataError(f"tracks.{target}: no row of the columns {names} says where {target} is")
    remark = left_out(
        values[timed], columns.quantity, f"rows of {target}", lambda index: table.place(int(timed[index]))
    )
    stamps = np.asarray(_FIRST_STAMP_NS + np.round(time_s[seen] * 1e9), np.int64)
    std = np.full(len(stamps), columns.std) if columns.std else None
    return Track(target, columns.quantity, stamps, values[seen], std), remark


def _first(rows: Floats, where: str) -> list[float]:
    """The first row without a gap."""
    whole = np.flatnonzero(np.isfinite(rows).all(axis=1))
    if not whole.size:
        raise DataError(f"{where}: no row has a number in each of its columns")
    return [float(number) for number in rows[whole[0]]]


def _constant(numbers: Numbers, table: Table, rows: int, where: str) -> float:
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
    scale = np.array(numbers.scale or (1.0,))
    offset = np.array(numbers.offset or (0.0,))
    for name, given in (("scale", scale), ("offset", offset), ("minus", np.array(numbers.minus or (None,)))):
        if len(given) not in (1, len(numbers.columns)):
            raise DataError(f"{where}.{name}: expected 1 or {len(numbers.columns)} entries, found {len(given)}")
    values = _stack(numbers.columns, table, rows, where)
    return np.asarray((values - _stack(numbers.minus or (None,), table, rows, where)) * scale + offset)


def _stack(names: Sequence[str | int | None], table: Table, rows: int, where: str) -> Floats:
    columns = [np.zeros(rows) if name is None else table.column(name, where) for name in names]
    for name, column in zip(names, columns, strict=True):
        if len(column) != rows:
            raise DataError(f"{where}: column '{name}' has {len(column)} rows, the time has {rows}")
    return np.stack(columns, axis=1)

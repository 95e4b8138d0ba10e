"""Tables of measurements become bags, as a YAML describes them (docs/foreign-bags.md lists its fields)."""

from __future__ import annotations

import os
from collections.abc import Sequence
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
from compass_ros.episodes.names import safe_name
from compass_ros.episodes.table_files import FORMATS, Table
from compass_ros.errors import BagError, ConfigError, DataError, nearest, shown
from compass_ros.types import QUANTITY_SIZE, Episode, Floats, Ints, Quantity, Track

DATA_VARIABLE = "COMPASS_REAL_DATA"
_PROJECT = Path(__file__).parents[2]
_FIRST_STAMP_NS = 10**9
"""Stamp of time 0 of a table: one second, because a stamp of 0 means `not set` in ROS."""

_strict = ConfigDict(extra="forbid")


@dataclass(frozen=True, config=_strict)
class TimeColumn:
    """Where the time of a row comes from: a column, or a rate."""

    column: str = ""
    unit_s: Annotated[float, Field(gt=0)] = 1.0
    """Seconds in one unit of the column."""
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


@dataclass(frozen=True, config=_strict)
class ImportConfig:
    """The YAML of an import."""

    cell: str
    recordings: tuple[Recordings, ...]
    time: TimeColumn
    tracks: dict[str, TrackColumns]
    initial_state: dict[str, Numbers] = field(default_factory=dict)
    """By object: from the first row."""
    action: dict[str, Numbers] = field(default_factory=dict)
    """By name of the action's field: one column, from the first row."""


def import_tables(yaml_path: str | Path, out: str | Path, data: str | Path | None = None) -> list[Path]:
    """Write one bag into the folder `out` for every recording that a YAML describes; returns their paths.

    The files are looked for in `data`; without it in the folder named by COMPASS_REAL_DATA, beside the YAML, and in
    `../shared/data` from the project's root.

    Raises:
        ConfigError: The YAML is wrong. DataError: a file is missing or does not hold what the YAML says.
        BagError: A bag exists already or cannot be written.
    """
    path = Path(yaml_path)
    config = _config(path)
    roots = [Path(data)] if data is not None else _roots(path)
    return [
        write_episode(episode, out)
        for recordings in config.recordings
        for episode in _episodes(config, recordings, _find(recordings.file, roots, path))
    ]


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
    pure = PurePosixPath(name)
    if pure.is_absolute() or ".." in pure.parts:
        raise ConfigError(f"{path}: file '{name}': expected a path inside the data folder")
    for root in roots:
        if (root / pure).is_file():
            return [root / pure]
        folder = root / pure.parent
        found = [f for f in folder.iterdir() if fnmatchcase(f.name, pure.name)] if folder.is_dir() else []
        if found:
            return sorted(found)
    looked = " or ".join(str(root) for root in roots)
    raise DataError(f"{path}: no file {name} in {looked}; name its folder with --data or {DATA_VARIABLE}")


def _episodes(config: ImportConfig, recordings: Recordings, files: Sequence[Path]) -> list[Episode]:
    found = [_episode(config, recordings, file, table) for file in files for table in _tables(recordings, file)]
    names = [episode.name for episode in found]
    where = files[0] if len(files) == 1 else files[0].parent / recordings.file
    if not found:
        raise DataError(f"{where}: no table matches '{recordings.tables}'")
    twice = [name for i, name in enumerate(names) if name in names[:i]]
    if twice:
        raise ConfigError(f"{where}: '{recordings.name}' gives the same name to several recordings, e.g. {twice[0]}")
    return found


def _tables(recordings: Recordings, file: Path) -> list[Table]:
    return list(FORMATS[recordings.format](file, recordings.tables, recordings.group_by))


def _episode(config: ImportConfig, recordings: Recordings, file: Path, table: Table) -> Episode:
    name = safe_name(_filled(recordings.name, table))
    try:
        stamps = _stamps(config.time, table)
        tracks = tuple(_track(target, columns, stamps, table) for target, columns in config.tracks.items())
        initial = {t: tuple(_rows(c, table, f"initial_state.{t}")[0].tolist()) for t, c in config.initial_state.items()}
        action = {t: float(_rows(c, table, f"action.{t}")[0, 0]) for t, c in config.action.items()}
        return Episode(name, config.cell, "", action, int(stamps[0]), tracks, initial)
    except (DataError, BagError) as error:
        where = str(file) if name == file.stem else f"{file}: {name}"
        raise DataError(f"{where}: {error}") from error


def _filled(template: str, table: Table) -> str:
    """A name with its labels put in. Raises ConfigError for anything in braces that is not a label."""
    try:
        fields = {name for _, name, _, _ in Formatter().parse(template) if name is not None}
        if fields <= table.labels.keys():
            return template.format(**table.labels)
    except ValueError as error:
        raise ConfigError(f"name '{template}': {error}") from error
    raise ConfigError(f"name '{template}': expected only {', '.join(f'{{{label}}}' for label in table.labels)}")


def _stamps(time: TimeColumn, table: Table) -> Ints:
    rows = len(next(iter(table.columns.values())))
    if time.column:
        column = table.column(time.column, "time")
        since = (column - column[0]) * time.unit_s
    elif time.rate_hz > 0:
        since = np.arange(rows) / time.rate_hz
    else:
        raise DataError("time: expected a column or a rate_hz")
    if not np.isfinite(since).all() or (np.diff(since) <= 0).any():
        bad = int(np.flatnonzero(~(np.diff(since) > 0))[0]) + 1
        raise DataError(f"time does not increase in row {bad + 1}: {since[bad - 1]:g} s, then {since[bad]:g} s")
    return np.asarray(_FIRST_STAMP_NS + np.round(since * 1e9), np.int64)


def _track(target: str, columns: TrackColumns, stamps: Ints, table: Table) -> Track:
    size = QUANTITY_SIZE[columns.quantity]
    if len(columns.columns) != size:
        raise DataError(f"{target}: expected {size} columns for '{columns.quantity}', found {len(columns.columns)}")
    values = _rows(columns, table, f"tracks.{target}")
    if not np.isfinite(values).all():
        raise DataError(f"{target}: not finite in row {int(np.flatnonzero(~np.isfinite(values).all(axis=1))[0]) + 1}")
    std = np.full(len(stamps), columns.std) if columns.std else None
    return Track(target, columns.quantity, stamps, values, std)


def _rows(numbers: Numbers, table: Table, where: str) -> Floats:
    """(F, columns) SI numbers. Raises DataError that says where in the YAML they are asked for."""
    scale = np.array(numbers.scale or (1.0,))
    offset = np.array(numbers.offset or (0.0,))
    for name, given in (("scale", scale), ("offset", offset), ("minus", np.array(numbers.minus or (None,)))):
        if len(given) not in (1, len(numbers.columns)):
            raise DataError(f"{where}.{name}: expected 1 or {len(numbers.columns)} entries, found {len(given)}")
    values, minus = _stack(numbers.columns, table, where), _stack(numbers.minus or (None,), table, where)
    return np.asarray((values - minus) * scale + offset)


def _stack(names: Sequence[str | int | None], table: Table, where: str) -> Floats:
    zeros = np.zeros(len(next(iter(table.columns.values()))))
    return np.stack([zeros if name is None else table.column(str(name), where) for name in names], axis=1)

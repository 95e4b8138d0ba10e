"""The YAML of an import, field by field (docs/foreign-bags.md)."""

from __future__ import annotations

from dataclasses import field
from pathlib import Path
from typing import Annotated, Literal

from pydantic import ConfigDict, Field, TypeAdapter, ValidationError
from pydantic.dataclasses import dataclass

from compass_ros.config import read_yaml
from compass_ros.episodes.measured import ONE_BY_ONE
from compass_ros.errors import ConfigError, nearest, shown
from compass_ros.types import Quantity

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
    """null: zero in every row. The name of a whole array stands for all its columns."""
    minus: tuple[str | int | None, ...] = ()
    """Columns to subtract, e.g. for the angle of one link relative to another."""
    scale: tuple[float, ...] = ()
    """SI units in one unit of the column; empty: 1."""
    offset: tuple[float, ...] = ()


@dataclass(frozen=True, config=_strict)
class TrackColumns(Numbers):
    """A track or an input."""

    quantity: Quantity = "xyz"
    of: tuple[str, ...] = ()
    """Of joints and scalars, a name for each column; of an input the numbers that the columns are (`vx`, `wz`)."""
    topic: Annotated[str, Field(max_length=200)] = ""
    """Where the bag holds it; empty: where a cell looks for it that names no topic either."""
    std: Annotated[float, Field(ge=0)] = 0.0
    """Standard deviation of one measurement [m or rad]; 0: not stated."""


@dataclass(frozen=True, config=_strict)
class Recordings:
    """Some tables of one file, or of several alike; each becomes a bag."""

    file: Annotated[str, Field(max_length=200)]
    """In the data folder; a pattern, as `throw_*.csv`, stands for all files that match."""
    format: Literal["csv", "xlsx", "npz", "mat", "parquet"]
    name: str
    """Name of the episode, with {key}, {group}, {index}; `names.safe_name` makes it a folder's."""
    tables: str = "*"
    """npz: pattern of the arrays' names; xlsx: of the sheets' names; mat, npz: variables side by side, `time=T
    state=Y`. With a star in them, `time=*.t state=*.q`, what it stands for parts the recordings and is their {key}."""
    group_by: str = ""
    """csv, xlsx, parquet: a column whose values part the rows into recordings."""
    header: Annotated[int, Field(ge=0)] | None = None
    """csv, xlsx: line of the columns' names, 0 where there is none; left out: it is looked for."""


@dataclass(frozen=True, config=_strict)
class ImportConfig:
    """The YAML of an import."""

    cell: str
    recordings: tuple[Recordings, ...]
    time: TimeColumn
    tracks: dict[str, TrackColumns]
    """By name of the object or signal."""
    inputs: dict[str, TrackColumns] = field(default_factory=dict)
    """By name of the input."""
    initial_state: dict[str, Numbers] = field(default_factory=dict)
    """By object: from the first row that has them all."""
    action: dict[str, Numbers] = field(default_factory=dict)
    """By name of the action's field: one column, the same number in all rows that have one."""


def read_config(path: Path) -> ImportConfig:
    """Raises ConfigError that says which field, and what was found."""
    try:
        config = TypeAdapter(ImportConfig).validate_python(dict(read_yaml(path)))
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        hint = nearest(str(first["loc"][-1]), ImportConfig.__dataclass_fields__)
        hint = hint if first["type"] == "unexpected_keyword_argument" else ""
        raise ConfigError(f"{path}: {where}: {first['msg']}, found {shown(first['input'])}{hint}") from error
    for name, one in config.tracks.items():
        if one.of and one.quantity not in ONE_BY_ONE:
            raise ConfigError(f"{path}: tracks.{name}.of: a track has all numbers of a {one.quantity}; leave `of` out")
    return config

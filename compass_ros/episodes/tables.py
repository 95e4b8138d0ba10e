"""Tables of measurements become bags, as a YAML describes them (docs/foreign-bags.md lists its fields)."""

from __future__ import annotations

import os
import unicodedata
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path, PurePosixPath
from string import Formatter

import numpy as np

from compass_ros.episodes.episode_writer import write_episode
from compass_ros.episodes.import_config import ImportConfig, Recordings, read_config
from compass_ros.episodes.names import safe_name
from compass_ros.episodes.sources import Source, default_topic
from compass_ros.episodes.table import Table
from compass_ros.episodes.table_files import FORMATS, Selection
from compass_ros.episodes.table_tracks import FIRST_STAMP_NS, constant_of, first_of, time_of, track_of
from compass_ros.errors import ConfigError, DataError
from compass_ros.types import Episode

DATA_VARIABLE = "COMPASS_REAL_DATA"
_PROJECT = Path(__file__).parents[2]


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
    config = read_config(path)
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
    bags = tuple(write_episode(episode, out, _sources(config)) for episode in episodes)
    remarks = (f"{episode.name}: {remark}" for episode in episodes for remark in episode.remarks)
    return Imported(bags, (*(f"left out: {error}" for error in refused), *remarks))


def _roots(path: Path) -> list[Path]:
    named = os.environ.get(DATA_VARIABLE)
    beside = _PROJECT.parent / "shared" / "data"  # of a clone; an installed package has none
    return [*([Path(named)] if named else []), path.parent, *([beside] if beside.is_dir() else [])]


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
    time_s = time_of(config.time, table)
    rows = len(time_s)
    tracks, inputs = (
        [track_of(target, columns, time_s, table, f"{section}.{target}") for target, columns in wanted.items()]
        for section, wanted in (("tracks", config.tracks), ("inputs", config.inputs))
    )
    said = [*table.remarks, *(remark for _, remark in (*tracks, *inputs) if remark)]
    untimed = int(np.sum(~np.isfinite(time_s)))
    if untimed:
        said.append(f"{untimed} of {rows} rows have no time and are left out")
    return Episode(
        name,
        config.cell,
        "",
        {target: constant_of(one, table, rows, f"action.{target}") for target, one in config.action.items()},
        min((int(track.stamp_ns[0]) for track, _ in tracks), default=FIRST_STAMP_NS),
        tuple(track for track, _ in tracks),
        {t: first_of(one, table, rows, f"initial_state.{t}") for t, one in config.initial_state.items()},
        remarks=tuple(said),
        inputs=tuple(track for track, _ in inputs),
    )


def _sources(config: ImportConfig) -> list[Source]:
    """Where the bags hold tracks and inputs."""
    return [
        Source(one.topic or default_topic(t, one.quantity, drives), t, one.quantity, of=one.of, drives=drives)
        for wanted, drives in ((config.tracks, False), (config.inputs, True))
        for t, one in wanted.items()
    ]


def _filled(template: str, table: Table) -> str:
    """A name with its labels put in. Raises ConfigError for anything in braces that is not a label."""
    try:
        fields = {name for _, name, _, _ in Formatter().parse(template) if name is not None}
        if fields <= table.labels.keys():
            return template.format(**table.labels)
    except ValueError as error:
        raise ConfigError(f"name '{template}': {error}") from error
    raise ConfigError(f"name '{template}': expected only {', '.join(f'{{{label}}}' for label in table.labels)}")

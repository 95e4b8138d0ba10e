"""Measurements of others as episodes: tables into bags once, then the bags."""

from __future__ import annotations

from pathlib import Path

from compass_ros.cells import Cell
from compass_ros.episodes import read_episodes
from compass_ros.episodes.tables import import_tables
from compass_ros.operation.current import sources
from compass_ros.types import Episode

IMPORTS = Path(__file__).parents[2] / "config" / "import"


def episodes(cell: Cell, name: str, out: Path, data: Path | None) -> tuple[Episode, ...]:
    """All recordings of `config/import/NAME.yaml`, by name. Bags that are in `out` already are not written again.

    Raises DataError where the tables are not there, and what reading bags raises.
    """
    folder = out / "bags" / name
    if not folder.is_dir():
        import_tables(IMPORTS / f"{name}.yaml", folder, data)
    return tuple(sorted(read_episodes([folder], sources(cell), cell.name), key=lambda e: e.name))

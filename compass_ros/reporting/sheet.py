"""A sheet: what several results say together, as one HTML page of the report's style and as tables in a terminal."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from rich.console import Console
from rich.table import Table as RichTable
from rich.text import Text

from compass_ros.reporting.atomic import write_text
from compass_ros.reporting.numbers import typeset
from compass_ros.reporting.report import page
from compass_ros.reporting.table import NARROW, STYLE
from compass_ros.reporting.words import Level

SCRIPTS = ("plot.js", "sheet.js", "page.js")
NAME_WIDE, CELL_WIDE = 26, 18
"""Letters of a name and of a value with its error bar in a terminal; columns that do not fit are left to the page."""


@dataclass(frozen=True)
class Line:
    """One sentence and what it means."""

    level: Level
    text: str


@dataclass(frozen=True)
class Table:
    title: str
    about: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    fixed: int = 1
    """First columns, which a narrow terminal shows too; of the others it shows the last."""


@dataclass(frozen=True)
class Series:
    """Points, one a place of the figure; NaN: none there."""

    name: str
    colour: str
    """Of the report's palette."""
    values: tuple[float, ...]
    errors: tuple[float, ...] = ()
    joined: bool = False
    """By a line."""


@dataclass(frozen=True)
class Figure:
    name: str
    unit: str
    places: tuple[str, ...]
    series: tuple[Series, ...]
    band: tuple[float, float] | None = None
    log: bool = False
    share: bool = False
    """Probabilities: from 0 to 1."""


@dataclass(frozen=True)
class Part:
    """A section of the page."""

    title: str
    about: str
    figures: tuple[Figure, ...]


@dataclass(frozen=True)
class Sheet:
    kind: Literal["history", "fleet"]
    cell: str
    eyebrow: str
    headline: str
    lines: tuple[Line, ...]
    parts: tuple[Part, ...]
    tables: tuple[Table, ...]


def write_sheet(sheet: Sheet, path: Path) -> None:
    """Write the page; it is whole or not there. Raises ConfigError when it cannot be written."""
    lines = [(line.level, typeset(line.text)) for line in sheet.lines]
    figures = [[_figure(figure) for figure in part.figures] for part in sheet.parts]
    shown = {"sheet": sheet, "headline": typeset(sheet.headline), "lines": lines}
    write_text(path, page("sheet.html.j2", SCRIPTS, figures, shown))


def _figure(figure: Figure) -> dict[str, object]:
    series = [
        {"name": s.name, "colour": s.colour, "joined": s.joined, "y": _finite(s.values), "error": _finite(s.errors)}
        for s in figure.series
    ]
    whole = {
        "name": figure.name,
        "unit": figure.unit,
        "places": figure.places,
        "log": figure.log,
        "share": figure.share,
    }
    return whole | {"series": series, "band": _finite(figure.band) if figure.band else None}


def _finite(values: Sequence[float]) -> list[float | None]:
    return [v if math.isfinite(v) else None for v in values]


def print_sheet(sheet: Sheet, console: Console | None = None) -> None:
    """The tables with their last columns, then what it says in words. Names are printed as they are."""
    out = console or Console()
    for table in sheet.tables:
        if not table.rows:
            continue
        fixed = table.fixed
        left_out = max(0, len(table.head) - max(fixed + (fixed == 1), 1 + (out.width - NAME_WIDE) // CELL_WIDE))
        caption = (
            Text(f"of {len(table.head) - fixed} columns {left_out} are left to --out and --json") if left_out else None
        )
        shown = RichTable(
            title=Text(table.title, "bold"), title_justify="left", caption=caption, caption_justify="left", **NARROW
        )
        for i, row in enumerate((table.head, *table.rows)):
            cells = [Text(cell) for cell in (*row[:fixed], *row[fixed + left_out :])]
            if i:
                shown.add_row(*cells)
                continue
            for column, cell in enumerate(cells):
                shown.add_column(cell, justify="right" if column else "left", overflow="fold")
        out.print(shown)
    for line in sheet.lines:
        out.print(Text(typeset(line.text), STYLE[line.level]))
    out.print(Text(typeset(sheet.headline), "bold"))

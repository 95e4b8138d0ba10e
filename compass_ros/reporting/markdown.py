"""Tables in Markdown, and the part of a page that a program writes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from compass_ros.errors import ConfigError
from compass_ros.reporting.atomic import write_text


def markdown_table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Cells are text, as they shall be read; no line end after the last row."""
    first, *others = [f"| {' | '.join(row)} |" for row in (header, *rows)]
    return "\n".join([first, "|" + "---|" * len(header), *others])


def between(page: str, begin: str, end: str) -> str:
    """What stands between two markers of a page; empty where they are not there."""
    return page.partition(begin)[2].partition(end)[0]


def replace_between(path: Path, begin: str, end: str, content: str) -> None:
    """Replace what stands between two markers of a page. Raises ConfigError where it has none."""
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read: {error.strerror}") from error
    before, first, rest = text.partition(begin)
    _, last, after = rest.partition(end)
    if not first or not last:
        raise ConfigError(f"{path}: expected the markers {begin.strip()} and {end.strip()}")
    write_text(path, f"{before}{begin}{content}{end}{after}")

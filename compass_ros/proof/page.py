"""The table of the proof as Markdown, between its markers in docs/proof.md."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path

from compass_ros.proof.lines import Line, counted
from compass_ros.proof.one_world import FOREIGN
from compass_ros.proof.scenes_table import rows as of_scenes
from compass_ros.proof.statistics import Row, table
from compass_ros.reporting.markdown import markdown_table, replace_between

BEGIN, END = "<!-- proof: begin -->\n", "<!-- proof: end -->"


def groups(found: Iterable[Line]) -> Mapping[tuple[str, str], list[Line]]:
    """Lines by suite and method."""
    out: dict[tuple[str, str], list[Line]] = {}
    for line in found:
        out.setdefault((str(line["suite"]), str(line["method"])), []).append(line)
    return dict(sorted(out.items()))


def markdown(found: Collection[Line]) -> str:
    """A section for each suite and method, with what made it and every world that came out wrong."""
    parts = []
    for (suite, method), among in groups(found).items():
        commits = ", ".join(sorted({str(line["commit"]) for line in among}))
        parts.append(f"### {suite}, method {method}: {counted(among)} (commit {commits})\n")
        parts.append(_table(rows_of(among)))
        parts.append(_wrong(among))
    foreign = [line for line in found if line["suite"] in FOREIGN]
    if foreign:
        parts.append(f"### worlds from other engines, all scenes: {counted(foreign)}\n")
        parts.append(_table(rows_of(foreign)))
    return "\n".join(parts)


def rows_of(among: Sequence[Line]) -> list[Row]:
    """The table of the worlds of one suite, or of several from other engines."""
    return of_scenes(among) if among and among[0]["suite"] in FOREIGN else table(among)


def _table(rows: Sequence[Row]) -> str:
    verdict = {True: "yes", False: "**no**", None: ""}
    cells = [(row.what, row.bar, row.value, row.interval, row.count, verdict[row.reached]) for row in rows]
    return markdown_table(("", "to reach", "reached", "95 % interval", "of", ""), cells) + "\n"


def _wrong(among: Sequence[Line]) -> str:
    """What was said instead, by true effect."""
    said: Counter[tuple[str, str]] = Counter()
    for line in among:
        marks = line.get("marks")
        if not marks:
            said[" + ".join(line.get("truth", ())) or "not played", str(line["error"])] += 1
        elif not marks["right"]:
            names = ", ".join(marks["found"])
            said[" + ".join(marks["truth"]) or "nothing", marks["verdict"] + (f": {names}" if names else "")] += 1
    if not said:
        return "No world came out wrong.\n"
    rows = [(true, instead, str(count)) for (true, instead), count in sorted(said.items())]
    return markdown_table(("true", "said instead", "worlds"), rows) + "\n"


def write_page(path: Path, found: Collection[Line]) -> None:
    """Replace what stands between the markers. Raises ConfigError where the page has none."""
    replace_between(path, BEGIN, END, markdown(found))

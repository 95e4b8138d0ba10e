"""The table of the proof as Markdown, between its markers in docs/proof.md."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from compass_ros.concealed.proof.lines import Line
from compass_ros.concealed.proof.statistics import Row, table
from compass_ros.errors import ConfigError
from compass_ros.reporting.atomic import write_text

BEGIN, END = "<!-- proof: begin -->", "<!-- proof: end -->"


def groups(found: Iterable[Line]) -> Mapping[tuple[str, str], list[Line]]:
    """Lines by suite and method."""
    out: dict[tuple[str, str], list[Line]] = {}
    for line in found:
        out.setdefault((str(line["suite"]), str(line["method"])), []).append(line)
    return dict(sorted(out.items()))


def markdown(found: Iterable[Line]) -> str:
    """A section for each suite and method, with what made it and every world that came out wrong."""
    parts = []
    for (suite, method), among in groups(found).items():
        commits = ", ".join(sorted({str(line["commit"]) for line in among}))
        parts.append(f"### {suite}, method {method}: {len(among)} worlds (commit {commits})\n")
        parts.append(_table(table(among)))
        parts.append(_wrong(among))
    return "\n".join(parts)


def _table(rows: Sequence[Row]) -> str:
    lines = ["| | to reach | reached | 95 % interval | of | |", "|---|---|---|---|---|---|"]
    for row in rows:
        verdict = {True: "yes", False: "**no**", None: ""}[row.reached]
        lines.append(f"| {row.what} | {row.bar} | {row.value} | {row.interval} | {row.count} | {verdict} |")
    return "\n".join(lines) + "\n"


def _wrong(among: Sequence[Line]) -> str:
    """What was said instead, by true effect."""
    said: Counter[tuple[str, str]] = Counter()
    for line in among:
        marks = line.get("marks")
        if not marks:
            said[" + ".join(line.get("truth", ())) or "?", str(line["error"])] += 1
        elif not marks["right"]:
            names = ", ".join(marks["found"])
            said[" + ".join(marks["truth"]) or "nothing", marks["verdict"] + (f": {names}" if names else "")] += 1
    if not said:
        return "No world came out wrong.\n"
    rows = [f"| {true} | {instead} | {count} |" for (true, instead), count in sorted(said.items())]
    return "\n".join(["| true | said instead | worlds |", "|---|---|---|", *rows]) + "\n"


def write_page(path: Path, found: Iterable[Line]) -> None:
    """Replace what stands between the markers. Raises ConfigError where the page has none."""
    replace_between(path, BEGIN, END, markdown(found))


def replace_between(path: Path, begin: str, end: str, content: str) -> None:
    """Replace what stands between two markers of a text file. Raises ConfigError where it has none."""
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise ConfigError(f"{path}: cannot be read: {error.strerror}") from error
    before, first, rest = text.partition(begin)
    _, last, after = rest.partition(end)
    if not first or not last:
        raise ConfigError(f"{path}: expected the markers {begin} and {end}")
    write_text(path, f"{before}{begin}\n{content}{end}{after}")

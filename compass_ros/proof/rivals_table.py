"""The rivals' table: our own row on the same worlds, then theirs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from compass_ros.proof.lines import Line, counted
from compass_ros.proof.statistics import felt, wilson
from compass_ros.reporting.markdown import markdown_table, replace_between

BEGIN, END = "<!-- rivals: begin -->\n", "<!-- rivals: end -->"
OURS, OUR_METHOD = "compass_ros", "default"
HEAD = (
    *("method", "one effect: named right", "two effects: both", "outside the library: misnamed"),
    *("nothing missing: false alarm", "anything missing: alarm"),
    *("held out [mm]", "above the floor [mm]", "time [s]"),
)
NAMED = 6
"""Columns of it that say what is missing; the others say how well it is predicted."""


@dataclass(frozen=True)
class Said:
    """What one method said about one world."""

    method: str
    kind: str
    right: bool | None
    misnamed: bool | None
    alarm: bool | None
    held_out_m: float | None
    floor_m: float | None
    seconds: float | None


def rows(rivals: Iterable[Line], ours: Iterable[Line]) -> list[tuple[str, ...]]:
    """Cells of the table for the worlds of one suite that the rivals have judged, less those that ours leaves out."""
    own = [line for line in ours if line["method"] == OUR_METHOD]
    faint = {_world(line) for line in own if not felt(line)}
    done = [line for line in rivals if line.get("rivals") and _world(line) not in faint]
    seeds = {_world(line) for line in done}
    said = [_own(line) for line in own if _world(line) in seeds and line.get("marks")]
    said += [_of(name, marks, line) for line in done for name, marks in line["rivals"].items()]
    methods = dict.fromkeys(s.method for s in said)
    return [_row(method, [s for s in said if s.method == method]) for method in methods]


def by_suite(rivals: Iterable[Line]) -> Mapping[str, list[Line]]:
    out: dict[str, list[Line]] = {}
    for line in rivals:
        out.setdefault(str(line["suite"]), []).append(line)
    return dict(sorted(out.items()))


def markdown(rivals: Iterable[Line], ours: Iterable[Line]) -> str:
    """A table for each suite, with what made it."""
    parts, own = [], list(ours)
    for suite, among in by_suite(rivals).items():
        commits = ", ".join(sorted({str(line["commit"]) for line in among}))
        failed = sum(1 for line in among if not line.get("rivals"))
        parts.append(f"### {suite}: {counted(among)}, {failed} of them failed (commit {commits})\n")
        parts.append(markdown_table(HEAD, rows(among, own)) + "\n")
    return "\n".join(parts) or "No run yet.\n"


def write_page(path: Path, rivals: Iterable[Line], ours: Iterable[Line]) -> None:
    """Replace what stands between the markers. Raises ConfigError where the page has none."""
    replace_between(path, BEGIN, END, markdown(rivals, ours))


def _world(line: Line) -> tuple[str, int]:
    return str(line["suite"]), int(line["seed"])


def _own(line: Line) -> Said:
    marks = line["marks"]
    held = marks["held_out_m"]
    error = held.get("with_effects", held.get("calibrated"))
    alarm = marks["verdict"] in ("named", "ambiguous", "unknown")
    return Said(OURS, marks["kind"], marks["right"], marks["misnamed"], alarm, error, held.get("floor"),
                line["seconds"]["calibrate"])  # fmt: skip


def _of(name: str, marks: Mapping[str, Any], line: Line) -> Said:
    return Said(
        name, line["kind"], marks["right"], marks["misnamed"], marks["alarm"], marks["held_out_m"], line["floor_m"],
        marks["seconds"],
    )  # fmt: skip


def _row(method: str, said: Sequence[Said]) -> tuple[str, ...]:
    kinds = {kind: [s for s in said if s.kind == kind] for kind in ("one", "two", "outside", "none")}
    something = [s for s in said if s.kind != "none"]
    above = [1e3 * (s.held_out_m - s.floor_m) for s in said if s.held_out_m is not None and s.floor_m is not None]
    return (
        method,
        _share(kinds["one"], lambda s: s.right),
        _share(kinds["two"], lambda s: s.right),
        _share(kinds["outside"], lambda s: s.misnamed),
        _share(kinds["none"], lambda s: s.alarm),
        _share(something, lambda s: s.alarm),
        _median([1e3 * s.held_out_m for s in said if s.held_out_m is not None], 2),
        _median(above, 2),
        _median([s.seconds for s in said if s.seconds is not None], 0),
    )


def _share(said: Sequence[Said], mark: Callable[[Said], bool | None]) -> str:
    """Share of True with Wilson's interval; n/a where the method does not answer that."""
    outcomes = [m for m in map(mark, said) if m is not None]
    if not outcomes:
        return "n/a" if said else "-"
    return f"{sum(outcomes)} of {len(outcomes)} ({wilson(outcomes)})"


def _median(values: Sequence[float], digits: int) -> str:
    return f"{np.median(values):.{digits}f}" if values else "n/a"

"""The league as a table, between its markers in docs/real-data.md."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from compass_ros.real.league import Line
from compass_ros.reporting.markdown import markdown_table, replace_between

BEGIN, END = "<!-- league: begin -->\n", "<!-- league: end -->"
COLUMNS = ("recordings", "mark", "verdict", "laws", "held out: as published", "calibrated", "with laws", "noise", "s")
AGREES = ("right", "class")


def markdown(lines: Iterable[Line]) -> str:
    """A row an entry, and how many kinds agree: a kind does where all its entries are right or of the class."""
    known = sorted(lines, key=lambda line: (line["kind"], line["name"]))
    kinds = list(dict.fromkeys(line["kind"] for line in known))
    agree = [k for k in kinds if all(line["mark"] in AGREES for line in known if line["kind"] == k)]
    wrong = [line["name"] for line in known if line["mark"] == "wrong"]
    answers = ", ".join(sorted({line["answers"][:16] for line in known}))
    commits = ", ".join(sorted({line["commit"] for line in known}))
    said = f"{len(agree)} of {len(kinds)} kinds agree; wrong: {', '.join(wrong) or 'none'}. "
    said += f"Answers {answers}, commit {commits}."
    return f"{said}\n\n{markdown_table(COLUMNS, [_row(line) for line in known])}\n" if known else "No runs yet.\n"


def _row(line: Line) -> Sequence[str]:
    head, seconds = (line["name"], f"**{line['mark']}**"), f"{line['seconds']:.0f}"
    if line["error"]:
        return (*head, line["error"].replace("|", "/"), "", "", "", "", "", seconds)
    gap = line["gap"]
    numbers = [_rms(gap[k], gap["unit"]) for k in ("nominal", "calibrated", "with_effects", "noise")]
    return (*head, line["verdict"], laws(line), *numbers, seconds)


def laws(line: Mapping[str, Any]) -> str:
    """Laws with their sizes where they are named, else the most probable explanations."""
    if line["verdict"] == "named":
        return "; ".join(f"`{e['name']}` {_sizes(e['parameters'])}" for e in line["effects"])
    sets = [(" + ".join(law["name"] for law in e["laws"]) or "none", e["probability"]) for e in line["explanations"]]
    return ", ".join(f"{name} ({p:.2f})" for name, p in sets[:3] if p >= 0.01)


def _sizes(quantities: Mapping[str, Any]) -> str:
    return ", ".join(f"{n} {q['value']:.3g} ± {q['std']:.1g} {q['unit']}" for n, q in quantities.items())


def _rms(value: float | None, unit: str) -> str:
    return "" if value is None else f"{1e3 * value:.3g} m{unit}"


def write_page(path: Path, lines: Iterable[Line]) -> None:
    """Replace what stands between the markers. Raises ConfigError where the page has none."""
    replace_between(path, BEGIN, END, markdown(lines))

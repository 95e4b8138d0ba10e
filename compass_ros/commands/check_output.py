"""What `compass check` found, as a table and as plain data."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from compass_ros.checks.check import Checked
from compass_ros.checks.figures import Figures
from compass_ros.checks.finding import Finding, Severity
from compass_ros.reporting.numbers import MISSING, percent, plain
from compass_ros.reporting.table import NARROW
from compass_ros.reporting.words import left_out_lines
from compass_ros.types import LeftOut

STYLE: Mapping[Severity, str] = {"bad": "bold red", "repaired": "bold green", "note": "bold yellow"}
WORD: Mapping[Severity, str] = {"bad": "Wrong", "repaired": "Mended", "note": "Note"}


def print_checked(
    checked: Checked, rows: Sequence[Figures], left_out: Sequence[LeftOut], console: Console | None = None
) -> None:
    """Print the table, what was found and whether the recordings can be used."""
    out = console or Console()
    out.print(_table(rows))
    for one in sorted(checked.findings, key=lambda one: list(STYLE).index(one.severity)):
        out.print(Text.assemble((f"{WORD[one.severity]}: ", STYLE[one.severity]), f"{one.sentence}."))
    for said in (*left_out_lines(left_out), *checked.remarks):
        out.print(Text.assemble(("Note: ", STYLE["note"]), f"{said}."))
    if checked.bad:
        out.print(Text("Usable? No: nothing may be concluded on physics before that is mended.", STYLE["bad"]))
    else:
        out.print(Text(f"Usable? Yes, {_many(len(checked.episodes))}.", STYLE["repaired"]))


def _many(count: int) -> str:
    return f"{count} recordings" if count != 1 else "one recording"


def _table(rows: Sequence[Figures]) -> Table:
    """What all rows share, one signal's name or a unit, is said once, at the head: names of joints fit then."""
    table = Table(**NARROW)
    heads, units = {row.signal.partition(".")[0] for row in rows}, {row.unit for row in rows}
    of_one = len(heads) == 1 and all("." in row.signal for row in rows)
    unit = f" [m{min(units)}]" if len(units) == 1 and any(units) else ""
    table.add_column(Text(f"{min(heads) if of_one else 'signal'}{unit}"), overflow="fold")
    for heading in ("Hz", "gaps", "noise", "step", "still", "stuck", "used", "delay"):
        table.add_column(Text(heading), justify="right", no_wrap=True)
    for row in rows:
        delay = f"{plain(1e3 * row.delay_s, 3)} ms" if math.isfinite(row.delay_s) else MISSING
        name = row.signal.partition(".")[2] if of_one else row.signal
        table.add_row(
            Text(f"{name} [m{row.unit}]" if row.unit and not unit else name),
            plain(row.rate_hz, 3),
            str(row.gaps),
            _thousandths(row.noise, row.unit),
            _thousandths(row.step, row.unit) if row.step else MISSING,
            *(percent(share) for share in (row.still, row.saturated, row.used)),
            delay,
        )
    return table


def _thousandths(value: float, unit: str) -> str:
    return plain(1e3 * value if unit else value, 3)


def as_dict(checked: Checked, rows: Sequence[Figures], left_out: Sequence[LeftOut]) -> dict[str, Any]:
    """Everything as JSON can hold it; null for a number that is not defined."""
    return {
        "usable": not checked.bad,
        "recordings": sorted(checked.recordings),
        "used": [e.name for e in checked.episodes],
        "left_out": [{"bag": one.bag, "reason": one.reason} for one in left_out],
        "signals": [{name: _number(value) for name, value in vars(row).items()} for row in rows],
        "findings": [_finding(one) for one in checked.findings],
        "remarks": list(checked.remarks),
    }


def _finding(one: Finding) -> dict[str, Any]:
    samples = {name: list(which) for name, which in one.samples.items()}
    return {
        "kind": one.kind,
        "severity": one.severity,
        "signal": one.signal,
        "samples": samples,
        "sentence": one.sentence,
    }


def _number(value: object) -> object:
    return None if isinstance(value, float) and not math.isfinite(value) else value

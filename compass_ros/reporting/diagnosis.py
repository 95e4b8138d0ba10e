"""A result explained in a terminal: the three answers, each check, and where and when something is left."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Column, Table
from rich.text import Text

from compass_ros.reporting.checks import SUMMARY, assess, overall
from compass_ros.reporting.extras import ReportExtras, ResidualMap
from compass_ros.reporting.numbers import MINUS, percent, plain, probability, unit_text, value_pm, with_unit
from compass_ros.reporting.residuals import error_curves, left_over
from compass_ros.reporting.table import STYLE, gap_table, parameter_table
from compass_ros.reporting.verdicts import meaning, title
from compass_ros.reporting.view.explanations import ranked, sites_named
from compass_ros.reporting.view.gap import signals
from compass_ros.reporting.view.missing import ranking
from compass_ros.reporting.windows import word
from compass_ros.reporting.words import (
    MODEL_LABEL,
    VERDICT_LEVEL,
    Level,
    where_rows,
)
from compass_ros.types import EffectFinding, Floats, Result

BARS = "▁▂▃▄▅▆▇█"
FULL, WIDTH = BARS[-1], 10
"""Of a bar that lies, and how long it is at a probability of 1."""
SHADES = "·░▒▓█"
MARK: dict[Level, str] = {"good": "+", "note": "-", "care": "!", "bad": "x"}


def print_diagnosis(result: Result, extras: ReportExtras, console: Console | None = None) -> None:
    """Print everything that a result says about its question 3, and whether to believe it."""
    out = console or Console()
    verdict = result.mismatch.verdict
    out.print(Text.assemble((f"{title(result.mismatch)}. ", STYLE[VERDICT_LEVEL[verdict]]), result.mismatch.sentence))
    out.print(Text(meaning(result.mismatch), "dim"))
    for heading, text in where_rows(result.mismatch.where, result.unit) if result.mismatch.where else ():
        out.print(Text(f"  {heading:8} {text}"))
    out.print(gap_table(result))
    out.print(parameter_table(result, extras.truth))
    for finding, sites in zip(result.mismatch.effects, sites_named(result.mismatch), strict=True):
        said = f"{finding.name} on {sites}" if sites else finding.name
        out.print(_effect(finding, said))
        out.print(Text(f"{said} {_evidence(finding)}"))
    if result.mismatch.explanations:
        out.print(_explanations(result))
        for row in ranked(result.mismatch):
            for note in row.notes:
                out.print(Text(f"  {row.name}: {note}", "dim"))
    elif extras.candidates:
        out.print(_candidates(result, extras))
    by_signal = signals(result)
    if by_signal["rows"]:
        out.print(_signals(by_signal))
    for line in (*_curves(result), *_map(left_over(result, extras))):
        out.print(line, no_wrap=True, overflow="crop")
    checks = assess(result)
    for check in checks:
        out.print(Text.assemble((f"{MARK[check.level]} {check.title}. ", STYLE[check.level]), check.detail))
    out.print(Text(f"Is the result good? {SUMMARY[overall(checks)]}", STYLE[overall(checks)]))
    if result.mismatch.undetectable:
        out.print(
            Text(f"These {word(result)}s could not have shown: " + ", ".join(result.mismatch.undetectable), "dim")
        )
    if result.mismatch.next_experiment:
        out.print(Text.assemble(("Next experiment: ", "bold"), result.mismatch.next_experiment))


def _evidence(finding: EffectFinding) -> str:
    evidence = finding.evidence
    said = [f"removes {percent(evidence.held_out_gain)} of the excess held-out error"]
    said.append(f"log evidence {plain(evidence.log_evidence, 3)}")
    said.append(f"false alarm {probability(evidence.false_alarm_p)}")
    if finding.equivalents:
        said.append("not told apart from " + ", ".join(finding.equivalents))
    return "; ".join(said)


def _effect(finding: EffectFinding, title: str) -> Table:
    table = Table("parameter", "value", "unit", title=Text(title, "bold"), title_justify="left")
    for name, p in finding.parameters.items():
        table.add_row(Text(name), Text(value_pm(p.value, p.std)), Text(unit_text(p.unit)))
    return table


def _explanations(result: Result) -> Table:
    columns = Column("removes", justify="right"), Column("held-out error", no_wrap=True)
    table = Table(
        Column("explanation", overflow="fold"),
        Column("probability", no_wrap=True),
        *columns,
        title="What could explain it",
        title_justify="left",
    )
    for row in ranked(result.mismatch):
        style = "bold" if row.kept else "dim"
        bar = FULL * round(row.share / 100 * WIDTH)
        cells = (row.name, f"{bar:{WIDTH}} {row.probability}", row.removes, row.errors)
        table.add_row(*(Text(cell, style) for cell in cells))
    return table


def _signals(by_signal: Mapping[str, Any]) -> Table:
    columns = [Column(heading, justify="right") for heading in (*MODEL_LABEL.values(), "floor")]
    table = Table("signal", *columns, "unit", title=f"Error by signal, {by_signal['on']}", title_justify="left")
    for row in by_signal["rows"]:
        name = f"  {row['name']}" if row["part"] else row["name"]
        table.add_row(*map(Text, (name, *row["numbers"], row["floor"], row["unit"])))
    return table


def _candidates(result: Result, extras: ReportExtras) -> Table:
    name, others = Column("candidate", overflow="fold"), ("channel", "log evidence", "held-out gain", "")
    columns = [Column(other, no_wrap=True) for other in others[:-1]]
    table = Table(name, *columns, others[-1], title="Tried", title_justify="left")
    for row in ranking(result, extras.candidates):
        style = "bold" if row["kept"] else "dim"
        table.add_row(*(Text(str(row[key]), style) for key in ("name", "channel", "evidence", "gain", "note")))
    return table


def _curves(result: Result) -> Iterator[Text]:
    """Error over time on a logarithmic scale from the noise floor to the largest error, one line a model."""
    curves = error_curves(result)
    largest = max((float(np.nanmax(c.rms_m)) for c in curves if np.isfinite(c.rms_m).any()), default=0.0)
    if not largest > 0:
        return
    floor = result.noise_floor_m if math.isfinite(result.noise_floor_m) else 0.0
    low = min(max(floor, largest * 1e-3), largest * 0.5)
    end = max(float(c.time_s[-1]) for c in curves)
    yield Text(
        f"Error over the {end:.1f} s of each {word(result)}, {BARS[0]} {with_unit(low, result.unit)} and less, "
        f"{BARS[-1]} {with_unit(largest, result.unit)}, logarithmic:"
    )
    width = max(len(c.object) for c in curves)
    for curve in curves:
        share = np.log(np.maximum(curve.rms_m, low) / low) / np.log(largest / low)
        yield Text(f"  {curve.object:{width}} {MODEL_LABEL[curve.model]:12} {_line(share, BARS)}")


def _line(share: Floats, signs: str) -> str:
    """One sign for each number in [0, 1]; a blank for NaN."""
    steps = len(signs) - 1
    return "".join(" " if math.isnan(s) else signs[min(max(round(s * steps), 0), steps)] for s in share.tolist())


def _map(residual: ResidualMap | None) -> Iterator[Text]:
    """Seen from above, two rows of cells in one line of text, so that the plane keeps its shape."""
    if residual is None or not np.isfinite(residual.value).any():
        return
    largest = float(np.nanmax(residual.value))
    rows = _pairs(residual.value)
    yield Text(
        f"What calibration leaves over, seen from above, {SHADES[0]} nothing, {SHADES[-1]} {plain(largest, 2)} "
        f"{residual.unit}:"
    )
    yield from (Text("  " + _line(row / largest if largest > 0 else row, SHADES).rstrip()) for row in rows[::-1])
    ends = [f"{float(axis[0]):.2f} to {float(axis[-1]):.2f} m" for axis in (residual.x_m, residual.y_m)]
    yield Text(f"  horizontal {ends[0]}, vertical {ends[1]}".replace("-", MINUS), "dim")


def _pairs(value: Floats) -> Sequence[Floats]:
    """(Y, X) -> ceil(Y / 2) rows, each the mean of two, NaN only where both are."""
    padded = np.concatenate([value, np.full((len(value) % 2, value.shape[1]), np.nan)])
    two = padded.reshape(-1, 2, value.shape[1])
    seen = np.isfinite(two).sum(axis=1)
    return list(np.where(seen > 0, np.nansum(two, axis=1) / np.maximum(seen, 1), np.nan))

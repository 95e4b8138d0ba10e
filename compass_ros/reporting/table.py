"""The result in a terminal: what was wrong, by how much it is better, what is left."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from compass_ros.reporting.checks import SUMMARY, assess, overall
from compass_ros.reporting.numbers import MISSING, plain, thousandths, unit_text, value_pm, with_unit
from compass_ros.reporting.verdicts import title
from compass_ros.reporting.words import (
    MODEL_LABEL,
    MODELS,
    VERDICT_LEVEL,
    Level,
    fit_rmse,
    held_out_rmse,
    in_error_bars,
    told,
)
from compass_ros.types import WRONG, ParameterRow, Result

STYLE: Mapping[Level, str] = {"good": "bold green", "note": "dim", "care": "bold yellow", "bad": "bold red"}


# Every name of the cells fits into 80 columns.
NARROW: Mapping[str, Any] = {"box": box.MINIMAL_HEAVY_HEAD, "pad_edge": False, "show_edge": False}


def print_result(result: Result, truth: Mapping[str, float] | None = None, console: Console | None = None) -> None:
    """Print the parameters that were wrong or matter, the gap, the checks that need attention, the verdict.

    Names are printed as they are: markup in them has no effect.
    """
    out = console or Console()
    out.print(parameter_table(result, truth or {}))
    print_verdict(result, out)


def print_verdict(result: Result, out: Console) -> None:
    """The gap, the checks that need attention, the verdict."""
    out.print(gap_table(result))
    checks = assess(result)
    level = overall(checks)
    for check in checks:
        if check.level in ("care", "bad"):
            out.print(Text.assemble((f"{check.title}. ", STYLE[check.level]), check.detail))
    out.print(Text(f"Is the result good? {SUMMARY[level]}", STYLE[level]))
    verdict = result.mismatch.verdict
    out.print(Text.assemble((f"{title(result.mismatch)}: ", STYLE[VERDICT_LEVEL[verdict]]), result.mismatch.sentence))
    if result.mismatch.next_experiment:
        out.print(Text.assemble(("Next experiment: ", "bold"), result.mismatch.next_experiment))


def parameter_table(result: Result, truth: Mapping[str, float]) -> Table:
    """What was wrong apart from what matters, each in the order of the cell; then what was missed, by the truth."""
    parts = {
        "wrong, with an edge": [row for row in result.parameters if row.wrong and row.active],
        "wrong, without an edge": [row for row in result.parameters if row.wrong and not row.active],
        "not moved, with an edge": [row for row in result.parameters if row.active and not row.wrong],
        "missed": [r for r in result.parameters if not told(r) and truth.get(r.name, r.default) != r.default],
    }
    hidden = len(result.parameters) - sum(len(rows) for rows in parts.values())
    caption = f"{hidden} further parameters have no edge" if hidden else ""
    if in_error_bars(result):
        caption += f" and moved by less than {WRONG:g} error bars" if hidden else ""
    else:
        parts = {"": parts["not moved, with an edge"], "missed": parts["missed"]}
    table = Table(caption=Text(caption, "dim"), caption_justify="left", **NARROW)
    table.add_column("parameter", overflow="fold")
    table.add_column("default", justify="right")
    table.add_column("found", justify="right")
    if truth:
        table.add_column("truth", justify="right")
    table.add_column("unit")
    for heading, rows in parts.items():
        if rows and heading:
            table.add_row(Text(heading, "italic"))
        for row in rows:
            cells = [Text(row.name), Text(plain(row.default)), _found(row)]
            if truth:
                cells.append(Text(plain(truth[row.name]) if row.name in truth else MISSING))
            table.add_row(*cells, Text(unit_text(row.unit)))
    return table


def _found(row: ParameterRow) -> Text:
    if not told(row):
        return Text(f"{plain(row.value)} (no edge)", "dim")
    doubt = "" if row.identifiable else " ?"
    return Text(value_pm(row.value, row.std) + doubt, "bold" if row.identifiable else "dim")


def gap_table(result: Result) -> Table:
    """Root mean square distance of each model, and its ratio to the nominal one and to the noise floor."""
    floor, unit = result.noise_floor_m, f"m{result.unit}"
    table = Table(caption=Text(f"noise floor {with_unit(floor, result.unit)}", "dim"), caption_justify="left", **NARROW)
    for heading in ("simulator", f"held out [{unit}]", "of nominal", "of floor", f"fitted [{unit}]"):
        table.add_column(Text(heading), justify="left" if heading == "simulator" else "right")
    nominal = held_out_rmse(result, "nominal")
    for model in MODELS:
        if model in result.gap:
            error = held_out_rmse(result, model)
            ratios = [_ratio(error, nominal), _ratio(error, floor)]
            table.add_row(MODEL_LABEL[model], thousandths(error), *ratios, thousandths(fit_rmse(result, model)))
    return table


def _ratio(error: float, base: float) -> str:
    return f"{error / base:.2f}" if math.isfinite(error) and math.isfinite(base) and base > 0 else MISSING

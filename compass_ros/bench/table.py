"""Tables in Markdown from the results of a benchmark, the paper's numbers beside ours."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from statistics import fmean, stdev

from compass_ros.bench.outcome import Row, case_of
from compass_ros.calibration.identifiability import IDENTIFIED
from compass_ros.cells import load
from compass_ros.reporting.markdown import markdown_table

PAPER_MAPE = {"compass": 0.22, "npdr": 0.29, "exi-net": 0.95, "tune-net": 3.85}
"""Mean absolute percentage error of the 8 causal parameters of air hockey, 5 seeds (caption of the paper's figure)."""

NINETY = 1.645
"""Standard deviations on either side of a normal distribution's mean that hold 90 % of it."""
Read = Callable[[Row], float]


def tables(rows: Sequence[Row]) -> str:
    """One table for each task and setting, methods as rows, mean ± standard deviation over seeds."""
    parts = []
    groups = sorted({(case_of(r).task, case_of(r).setting()) for r in rows})
    for task, setting in groups:
        chosen = [r for r in rows if (case_of(r).task, case_of(r).setting()) == (task, setting)]
        parts.append(f"### {task}{': ' + setting if setting else ''}\n\n{table(chosen)}")
    return "\n\n".join(parts)


def table(rows: Sequence[Row]) -> str:
    """Methods as rows, best held-out trajectory difference first."""
    methods = sorted({case_of(r).method for r in rows}, key=lambda m: mean(_of(rows, m), held_out_difference))
    main = bool(rows) and case_of(rows[0]).task == "air_hockey" and not case_of(rows[0]).setting()
    header = ["method", "seeds", "MAPE, causal", "MAPE, identified (n)", "held-out d [m]", "share of nominal"]
    header += ["held-out rms / floor", "90 % intervals hold", "kept", "precision", "recall"]
    header += ["rollouts", "simulated [s]"]
    header += ["wall [s]"]
    if main:
        header.insert(3, "paper's MAPE")
    lines = []
    for name in methods:
        own = _of(rows, name)
        identified = f"{cell(own, number('mape_identified'))} ({mean(own, lambda r: len(_list(r, 'identified'))):.1f})"
        cells = [name, str(len(own)), cell(own, number("mape")), identified, cell(own, held_out_difference)]
        cells += [cell(own, share_of_nominal), cell(own, number("held_out_over_floor")), coverage(own)]
        cells += [cell(own, edge(part)) for part in ("kept", "precision", "recall")]
        cells += [f"{mean(own, number(f)):.0f}" for f in ("rollouts_counted_by_simulator", "simulated_seconds")]
        cells += [cell(own, number("wall_seconds"))]
        if main:
            cells.insert(3, f"{PAPER_MAPE[name]:.2f}" if name in PAPER_MAPE else "-")
        lines.append(cells)
    return markdown_table(header, lines)


def number(field: str) -> Read:
    """Reads a number of a row; NaN where it has none."""

    def read(row: Row) -> float:
        value = row.get(field)
        return float(value) if isinstance(value, (int, float)) else math.nan

    return read


def edge(field: str) -> Read:
    """Reads a score of the edges; NaN for methods without a graph."""

    def read(row: Row) -> float:
        scored = row.get("edges")
        value = scored.get(field) if isinstance(scored, dict) else None
        return float(value) if isinstance(value, (int, float)) else math.nan

    return read


def held_out_difference(row: Row) -> float:
    """Mean over the factors of the held-out trajectory difference, noise-free [m, for angles rad]."""
    return _difference(row, "held_out")


def share_of_nominal(row: Row) -> float:
    """The same as a share of that of the first guess."""
    return _difference(row, "held_out") / _difference(row, "held_out_nominal")


def coverage(rows: Iterable[Row]) -> str:
    """How often the truth is within 1.645 stated standard deviations, over all parameters with noise and such bars.

    Of each row those count whose prior width the recordings halved; `-` for methods without error bars and for
    recordings without noise, whose errors are the simulator's own last digits.
    """
    held: list[bool] = []
    for row in rows:
        case = case_of(row)
        if case.noise_m > 0:
            values, std = _numbers(row, "values"), _numbers(row, "std")
            held += [
                abs(values[p.name] - p.truth) < NINETY * std[p.name]
                for p in load(case.task, case.parameters).spec.parameters
                if std[p.name] < IDENTIFIED * p.half_width
            ]
    return f"{100 * fmean(held):.0f} % of {len(held)}" if held else "-"


def mean(rows: Iterable[Row], read: Read) -> float:
    """Mean over the rows that have the number."""
    values = [v for v in map(read, rows) if math.isfinite(v)]
    return fmean(values) if values else math.nan


def cell(rows: Sequence[Row], read: Read) -> str:
    """`mean ± standard deviation`, three digits; `-` where no row has the number."""
    values = [v for v in map(read, rows) if math.isfinite(v)]
    if not values:
        return "-"
    middle = fmean(values)
    return f"{middle:.3g} ± {stdev(values):.2g}" if len(values) > 1 else f"{middle:.3g}"


def _difference(row: Row, which: str) -> float:
    gap = row[which]
    assert isinstance(gap, dict)
    return fmean(gap["d"].values())


def _of(rows: Sequence[Row], name: str) -> list[Row]:
    return [r for r in rows if case_of(r).method == name]


def _list(row: Row, field: str) -> list[object]:
    value = row[field]
    assert isinstance(value, list)
    return value


def _numbers(row: Row, field: str) -> dict[str, float]:
    """Numbers by name; NaN where the method gives none."""
    value = row[field]
    assert isinstance(value, dict)
    return {name: math.nan if number is None else float(number) for name, number in value.items()}

"""A history and a fleet as sheets: sentences, figures, tables."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from compass_ros.operation.fleet import Fleet, Spread
from compass_ros.operation.history import History, leading
from compass_ros.operation.several import BY_CHANCE, Number, Run, explanations, signals
from compass_ros.reporting.numbers import MISSING, plain, probability, unit_text, value_pm
from compass_ros.reporting.sheet import Figure, Line, Part, Series, Sheet, Table
from compass_ros.reporting.words import VERDICT_TITLE

SHOWN = 0.01
"""Probability that an explanation needs in some run to get a line."""


def history_sheet(found: History, left_out: Sequence[str]) -> Sheet:
    """The figures of what has moved come first."""
    runs, moved = found.runs, list(dict.fromkeys(move.name for move in found.moves))
    names = [*moved, *(name for name in found.table if name not in moved)]
    chance = found.comparisons * BY_CHANCE
    said = (
        f"{found.comparisons} differences were looked at; where nothing changes about {plain(chance, 2)} show by chance"
    )
    lines = [
        *(Line("care", move.sentence) for move in found.moves),
        *(Line("note", note) for note in (*found.notes, *left_out, said)),
    ]
    what = f"{len(moved)} of {len(names)} numbers moved" if moved else f"None of {len(names)} numbers moved"
    now = leading(runs[-1]) or VERDICT_TITLE[runs[-1].result.mismatch.verdict].lower()
    return Sheet(
        "history",
        runs[0].result.cell,
        f"{len(runs)} calibrations, {runs[0].label} to {runs[-1].label}",
        f"{what} by more than three joint error bars; what is left in {runs[-1].label}: {now}.",
        tuple(lines),
        (
            Part("Parameters", "Each calibration with one standard deviation; what has moved first.",
                 tuple(_figure(name, found.table[name], runs) for name in names)),
            Part("Gaps", "Error by signal of the best simulator of a week, on held-out episodes where there are any; "
                 "the noise floor beside it.", tuple(_gap_figures(runs))),
            Part("Explanations", "What could be missing, and how probable it is.", tuple(_explanation_figures(runs))),
        ),
        (_numbers_table(names, found.table, runs), _gap_table(runs), _explanation_table(runs)),
    )  # fmt: skip


def fleet_sheet(found: Fleet, left_out: Sequence[str]) -> Sheet:
    """The figures of what differs come first."""
    units, lines = found.units, [Line("care", sentence) for sentence in found.sentences]
    ordered = sorted(found.spreads, key=lambda one: min(one.odd.values(), default=1.0))
    shared = [Line("good", f"all units: {name}") for name in found.shared_laws]
    chance = found.comparisons * BY_CHANCE
    said = f"{found.comparisons} values were compared; where no unit differs about {plain(chance, 2)} show by chance"
    few = f"told by less than three units, and not compared: {', '.join(found.alone)}"
    notes = [said, *([few] if found.alone else []), *left_out]
    headline = "No unit differs from the others by more than their spread."
    if found.odd:
        verb = "differ" if len(found.odd) > 1 else "differs"
        headline = f"{', '.join(run.label for run in units if run.label in found.odd)} {verb} from the others."
    head = ("number", "fleet", "spread", "outside", *(run.label for run in units))
    law_head = ("law", *(run.label for run in units))
    return Sheet(
        "fleet",
        units[0].result.cell,
        f"{len(units)} units",
        headline,
        (*lines, *shared, *(Line("note", note) for note in notes)),
        (Part("Numbers", "Blue: each unit's own calibration. Green: its value when the fleet is taken into account; "
              "the band is the fleet's mean with the spread between units. What differs comes first; * marks it.",
              tuple(_spread_figure(one, units) for one in ordered)),),
        (
            Table("Numbers", "", head, tuple(_spread_row(one, units) for one in ordered), 4),
            Table("Laws, and how probable they are in each unit", "", law_head,
                  tuple((name, *(probability(by.get(run.label, math.nan)) for run in units))
                        for name, by in found.laws.items())),
        ),
    )  # fmt: skip


def _figure(name: str, series: Mapping[str, Number], runs: Sequence[Run]) -> Figure:
    values, errors = _points(series, runs)
    unit = unit_text(next(iter(series.values())).unit)
    return Figure(name, unit, _labels(runs), (Series(name, "calibrated", values, errors, joined=True),))


def _points(series: Mapping[str, Number], runs: Sequence[Run]) -> tuple[tuple[float, ...], tuple[float, ...]]:
    said = [series.get(run.label, Number(math.nan, math.nan, "")) for run in runs]
    return tuple(one.value for one in said), tuple(one.std for one in said)


def _labels(runs: Sequence[Run]) -> tuple[str, ...]:
    return tuple(run.label for run in runs)


def _gap_figures(runs: Sequence[Run]) -> list[Figure]:
    every = [signals(run.result) for run in runs]
    names = dict.fromkeys(name for one in every for name in one)
    figures = []
    for name in names:
        said = [one.get(name) for one in every]
        unit = next(one.unit for one in said if one is not None)
        rms = Series("error", "calibrated", tuple(math.nan if s is None else s.rms for s in said), joined=True)
        floor = Series("noise floor", "faint", tuple(math.nan if s is None else s.floor for s in said), joined=True)
        figures.append(Figure(name, unit_text(unit), _labels(runs), (rms, floor), log=True))
    return figures


def _likely(runs: Sequence[Run]) -> list[tuple[str, tuple[float, ...]]]:
    every = [explanations(run.result) for run in runs]
    names = dict.fromkeys(name for one in every for name, p in one.items() if p >= SHOWN)
    return [(name, tuple(one.get(name, 0.0) if one else math.nan for one in every)) for name in names]


def _explanation_figures(runs: Sequence[Run]) -> list[Figure]:
    return [
        Figure(name, "", _labels(runs), (Series(name, "with_effects", p, joined=True),), share=True)
        for name, p in _likely(runs)
    ]


def _numbers_table(names: Sequence[str], table: Mapping[str, Mapping[str, Number]], runs: Sequence[Run]) -> Table:
    rows = []
    for name in names:
        series = table[name]
        cells = [_cell(series.get(run.label)) for run in runs]
        rows.append((f"{name} [{unit_text(next(iter(series.values())).unit) or '1'}]", *cells))
    about = f"{MISSING}: the recordings of that run do not tell it."
    return Table("Numbers", about, ("number", *_labels(runs)), tuple(rows))


def _cell(one: Number | None) -> str:
    return MISSING if one is None else value_pm(one.value, one.std)


def _gap_table(runs: Sequence[Run]) -> Table:
    every = [signals(run.result) for run in runs]
    rows = []
    for name in dict.fromkeys(name for one in every for name in one):
        said = [one.get(name) for one in every]
        cells = [
            MISSING if s is None else f"{plain(s.rms, 3)} ({plain(s.rms / s.floor, 2) if s.floor > 0 else MISSING})"
            for s in said
        ]
        rows.append((f"{name} [{unit_text(next(s.unit for s in said if s is not None)) or '1'}]", *cells))
    return Table("Error by signal (in noise floors)", "", ("signal", *_labels(runs)), tuple(rows))


def _explanation_table(runs: Sequence[Run]) -> Table:
    rows = [(name, *(probability(p) for p in by)) for name, by in _likely(runs)]
    return Table("Explanations and their probabilities", "", ("explanation", *_labels(runs)), tuple(rows))


def _spread_figure(one: Spread, units: Sequence[Run]) -> Figure:
    own = Series("its own calibration", "calibrated", *_points(one.units, units))
    shrunk = Series("with the fleet", "with_effects", *_points(one.shrunk, units))
    places = tuple(f"{run.label} *" if run.label in one.odd else run.label for run in units)
    band = (one.mean.value - one.tau, one.mean.value + one.tau)
    return Figure(one.name, unit_text(one.mean.unit), places, (own, shrunk), band)


def _spread_row(one: Spread, units: Sequence[Run]) -> tuple[str, ...]:
    cells = [_cell(one.units.get(run.label)) + (" *" if run.label in one.odd else "") for run in units]
    name = f"{one.name} [{unit_text(one.mean.unit) or '1'}]"
    return (name, value_pm(one.mean.value, one.mean.std), plain(one.tau, 2), ", ".join(one.odd) or MISSING, *cells)

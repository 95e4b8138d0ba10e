"""How one cell changes from week to week: which numbers moved by more than their error bars allow, and when."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from typing import Any, Literal

import numpy as np

from compass_ros.operation.several import Number, Run, explanations, mean, signals, table_of
from compass_ros.reporting.checks import NEAR_FLOOR
from compass_ros.reporting.numbers import plain, unit_text, with_error
from compass_ros.reporting.words import held_out_rmse
from compass_ros.types import WRONG

SCHEMA_ID = "compass/history/1"
FEWEST = 3
"""Runs from which a straight line says more than a step."""


@dataclass(frozen=True)
class Move:
    """A number that is not what it was."""

    name: str
    kind: Literal["step", "drift"]
    """A step lies between two runs; a drift is a straight line over several, of which no step shows."""
    before: str
    """Run after which, or from which on."""
    after: str
    """Run in which it was seen, or until which."""
    was: Number
    now: Number
    error_bars: float
    """The change in joint standard deviations of both ends (a drift: of the slope)."""

    @property
    def sentence(self) -> str:
        when = f"moved between {self.before} and {self.after}" if self.kind == "step" else (
            f"drifted from {self.before} to {self.after}"
        )  # fmt: skip
        change = f"{value_of(self.was)} -> {value_of(self.now)} {unit_text(self.now.unit)}".rstrip()
        bars = "joint error bars" if self.kind == "step" else "error bars of the slope"
        return f"{self.name} {when}: {change} ({plain(self.error_bars, 2)} {bars})"


def value_of(one: Number) -> str:
    text, error = with_error(one.value, one.std)
    return f"{text} +- {error}"


@dataclass(frozen=True)
class History:
    runs: tuple[Run, ...]
    table: dict[str, dict[str, Number]]
    """Number by name and run."""
    moves: tuple[Move, ...]
    comparisons: int
    """How many differences were looked at: 0.3 % of them pass three error bars by chance."""
    notes: tuple[str, ...]
    """What else changed between two runs."""


def history(runs: Sequence[Run]) -> History:
    """`runs` in the order of time."""
    table, moves, comparisons = table_of(runs), list[Move](), 0
    order = {run.label: i for i, run in enumerate(runs)}
    for name, series in table.items():
        found, count = moves_of(name, series, order)
        moves += found
        comparisons += count
    moves.sort(key=lambda one: (order[one.after], -one.error_bars))
    return History(tuple(runs), table, tuple(moves), comparisons, _notes(runs))


def moves_of(name: str, series: dict[str, Number], order: dict[str, int]) -> tuple[list[Move], int]:
    """Steps of one number, drifts between them, and how many differences that took.

    Each run is compared with the mean of those since the last step, weighted by their error bars; a stretch without a
    step is asked for a slope over the runs' places in the order. Error bars of different calibrations count as
    independent.
    """
    labels = [*series]
    stretches, steps, count = [[labels[0]]], list[Move](), 0
    for label in labels[1:]:
        was, now = mean([series[one] for one in stretches[-1]]), series[label]
        bars, count = abs(now.value - was.value) / math.hypot(now.std, was.std), count + 1
        if bars > WRONG:
            steps.append(Move(name, "step", stretches[-1][-1], label, was, now, bars))
            stretches.append([label])
        else:
            stretches[-1].append(label)
    long = [one for one in stretches if len(one) >= FEWEST]
    drifts = [d for one in long if (d := _drift(name, one, [series[label] for label in one], order)) is not None]
    return [*steps, *drifts], count + len(long)


def _drift(name: str, labels: Sequence[str], said: Sequence[Number], order: dict[str, int]) -> Move | None:
    """The ends of the straight line of weighted least squares, where its slope is more than three of its error bars."""
    place = np.array([order[label] for label in labels], dtype=float)
    weight = np.array([one.std**-2 for one in said])
    value = np.array([one.value for one in said])
    middle = weight @ place / weight.sum()
    stiffness = weight @ (place - middle) ** 2
    slope, slope_std = float(weight @ ((place - middle) * value) / stiffness), float(stiffness**-0.5)
    if abs(slope) <= WRONG * slope_std:
        return None

    def at(where: float) -> Number:
        std = math.hypot(float(weight.sum() ** -0.5), (where - middle) * slope_std)
        return Number(float(weight @ value / weight.sum() + slope * (where - middle)), std, said[0].unit)

    return Move(name, "drift", labels[0], labels[-1], at(place[0]), at(place[-1]), abs(slope) / slope_std)


def _notes(runs: Sequence[Run]) -> tuple[str, ...]:
    """What moved that is no number: the first explanation, the cell's defaults, versions of what computes. And which
    runs miss their recordings by so much that error bars, which hold noise alone, cannot carry a comparison."""
    said = []
    far = [one.label for one in runs if held_out_rmse(one.result, "calibrated") > NEAR_FLOOR * one.result.noise_floor_m]
    if far:
        said.append(
            f"{', '.join(far)}: far above the noise floor, and error bars hold noise alone: what moved there may be "
            "the recordings and not the robot"
        )
    for before, after in pairwise(runs):
        one, other = ({r.name: r.default for r in run.result.parameters} for run in (before, after))
        changed = [name for name in one if name in other and one[name] != other[name]]
        if changed:
            names = ", ".join(changed[:3]) + (f" and {len(changed) - 3} more" if len(changed) > 3 else "")
            said.append(f"{after.label}: the cell has other defaults than in {before.label}: {names}")
        first, second = (leading(run) for run in (before, after))
        if first and second and first != second:
            said.append(f"{after.label}: the most probable explanation is no longer '{first}' but '{second}'")
        for package in ("compass_ros", "mujoco"):
            old, new = (run.result.versions.get(package, "") for run in (before, after))
            if old != new:
                said.append(f"{after.label}: computed with {package} {new}, {before.label} with {old}")
    return tuple(said)


def leading(run: Run) -> str:
    """Name of the most probable explanation; empty where nobody asked."""
    said = explanations(run.result)
    return max(said, key=lambda name: said[name]) if said else ""


def to_json(found: History) -> dict[str, Any]:
    """What `--json` prints; a run that does not tell a number is absent there."""
    return {
        "schema": SCHEMA_ID,
        "cell": found.runs[0].result.cell,
        "runs": [
            {
                "name": run.label,
                "verdict": run.result.mismatch.verdict,
                "signals": {name: finite(asdict(one)) for name, one in signals(run.result).items()},
                "explanations": explanations(run.result),
            }
            for run in found.runs
        ],
        "numbers": {name: {run: asdict(one) for run, one in series.items()} for name, series in found.table.items()},
        "moves": [{**asdict(move), "sentence": move.sentence} for move in found.moves],
        "comparisons": found.comparisons,
        "notes": list(found.notes),
    }


def finite(content: dict[str, Any]) -> dict[str, Any]:
    """JSON has no NaN: null."""
    return {k: None if isinstance(v, float) and not math.isfinite(v) else v for k, v in content.items()}

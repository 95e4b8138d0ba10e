"""Results of several calibrations of one cell, side by side: of many weeks, or of several robots of one kind."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.special import ndtr

from compass_ros.config import read_yaml
from compass_ros.errors import ConfigError
from compass_ros.operation.versions import NOT_TO_BE_APPLIED
from compass_ros.reporting.from_json import from_json
from compass_ros.reporting.kept import RESULT
from compass_ros.reporting.result_json import read_result
from compass_ros.reporting.view.explanations import ranked
from compass_ros.reporting.words import best_model
from compass_ros.types import WRONG, Explanation, Result, SignalGap

LIKELY = 0.5
"""Probability from which a law counts as there."""
BY_CHANCE = float(2 * ndtr(-WRONG))
"""Probability that a normal number lies beyond three error bars."""


@dataclass(frozen=True)
class Run:
    """One calibration."""

    label: str
    """Its folder, from where all folders lie."""
    folder: Path
    result: Result


@dataclass(frozen=True)
class Number:
    """What one calibration says of one number."""

    value: float
    std: float
    unit: str


def mean(said: Sequence[Number], variance: float = 0.0) -> Number:
    """Weighted by error bars, to which this variance is added."""
    weights = np.array([1 / (one.std**2 + variance) for one in said])
    return Number(
        float(weights @ [one.value for one in said] / weights.sum()), float(weights.sum() ** -0.5), said[0].unit
    )


def read_runs(folders: Sequence[Path]) -> tuple[tuple[Run, ...], tuple[str, ...]]:
    """Runs in the order given, and in words which were left out, and why.

    A folder without a result stands for the results in it, by name: weeks in one folder, or the versions of a cell.
    Raises ConfigError: less than two can be used, one is of another cell, or has a parameter in another unit.
    """
    found = [path for folder in folders for path in _results(folder)]
    twice = next((path for i, path in enumerate(found) if path.resolve() in [one.resolve() for one in found[:i]]), None)
    if twice is not None:
        raise ConfigError(f"{twice}: named twice")
    runs = [
        Run(label, path, from_json(read_result(path / RESULT)))
        for path, label in zip(found, _labels(found), strict=True)
    ]
    used, left_out = [], []
    for run in runs:
        why = "it was cut short" if run.result.cancelled else f"its verdict is '{run.result.mismatch.verdict}'"
        if run.result.cancelled or run.result.mismatch.verdict in NOT_TO_BE_APPLIED:
            left_out.append(f"{run.label} was left out: {why}")
        else:
            used.append(run)
    if len(used) < 2:
        raise ConfigError(f"{', '.join(map(str, folders))}: expected two usable results or more, found {len(used)}")
    _check_alike(used)
    return tuple(used), tuple(left_out)


def _results(folder: Path) -> list[Path]:
    path = folder.parent if folder.name == RESULT else folder
    if (path / RESULT).is_file():
        return [path]
    inside = sorted(one.parent for one in path.glob(f"*/{RESULT}"))
    if not inside:
        raise ConfigError(f"{path}: expected a folder of a result, or of such folders, found no {RESULT}")
    return inside


def _labels(paths: Sequence[Path]) -> list[str]:
    """Paths from where all lie; a version that was applied has its time of day beside."""
    shared = os.path.commonpath([path.absolute().parent for path in paths])
    labels = []
    for path in paths:
        origin = path / "origin.yaml"
        at = read_yaml(origin).get("applied_at") if origin.is_file() else None
        labels.append(os.path.relpath(path.absolute(), shared) + (f" ({str(at)[:10]})" if at else ""))
    return labels


def _check_alike(runs: Sequence[Run]) -> None:
    first, units = runs[0], {row.name: row.unit for row in runs[0].result.parameters}
    for run in runs[1:]:
        if run.result.cell != first.result.cell:
            raise ConfigError(
                f"{run.folder}: a result of '{run.result.cell}', {first.folder} is of '{first.result.cell}'"
            )
        for row in run.result.parameters:
            if units.setdefault(row.name, row.unit) != row.unit:
                raise ConfigError(f"{run.folder}: {row.name}: in {row.unit}, before in {units[row.name]}")


def numbers(result: Result) -> dict[str, Number]:
    """What the recordings have told: identifiable parameters, and quantities of the laws that are there, by name."""
    said = {row.name: Number(row.value, row.std, row.unit) for row in result.parameters if row.identifiable}
    first = next(iter(result.mismatch.explanations), None)
    if first is not None and first.probability > LIKELY:
        for law in first.laws:
            where = f" on {', '.join(law.sites)}" if law.sites else ""
            said |= {f"{law.name}{where}: {n}": Number(q.value, q.std, q.unit) for n, q in law.quantities.items()}
    return {name: one for name, one in said.items() if math.isfinite(one.value) and 0 < one.std < math.inf}


def table_of(runs: Sequence[Run]) -> dict[str, dict[str, Number]]:
    """Number by name and run, for what at least one of them tells."""
    every = [numbers(run.result) for run in runs]
    names = dict.fromkeys(name for one in every for name in one)
    return {n: {run.label: one[n] for run, one in zip(runs, every, strict=True) if n in one} for n in names}


def signals(result: Result) -> Mapping[str, SignalGap]:
    """Error of the best simulator by signal, on held-out episodes where there are any."""
    parts = result.gap.get(best_model(result), {})
    gap = parts.get("held_out", parts.get("fit"))
    if gap is None:
        return {}
    return gap.signals or {"all": SignalGap(gap.rmse_m, result.unit, result.noise_floor_m)}


def explanations(result: Result) -> dict[str, float]:
    """Probability of each explanation by its name; empty where nobody asked."""
    said: dict[str, float] = {}
    for row, one in zip(ranked(result.mismatch), result.mismatch.explanations, strict=True):
        said[row.name] = said.get(row.name, 0.0) + one.probability
    return said


def laws(result: Result) -> dict[str, float]:
    """Probability that a law acts on a site, over all explanations: `backlash on elbow`; empty where nobody asked."""
    said: dict[str, float] = {}
    for one in result.mismatch.explanations:
        for name in _pairs(one):
            said[name] = said.get(name, 0.0) + one.probability
    return said


def _pairs(one: Explanation) -> set[str]:
    return {f"{law.name} on {site}" if site else law.name for law in one.laws for site in law.sites or ("",)}

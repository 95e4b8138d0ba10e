"""A result judged on recordings that it has not seen: next week's, or another robot's.

Nothing is fitted but where each episode began, within the noise of its first state.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from compass_ros.cells import Cell
from compass_ros.checks.check import check
from compass_ros.operation.current import Current, current
from compass_ros.posing import launched, noise_of
from compass_ros.reporting.from_json import from_json
from compass_ros.reporting.result_json import read_result
from compass_ros.simulation.replay import recordings
from compass_ros.simulation.windows import usable, windows
from compass_ros.types import Episode, Gap, LeftOut

Model = Literal["nominal", "calibrated", "with_laws"]


@dataclass(frozen=True)
class Judged:
    """One model beside the recordings."""

    gap: Gap
    removed: Mapping[str, float]
    """Share of the nominal simulator's excess over the noise that this one removes, by signal.

    1: all of it, 0: none, negative: it is worse; NaN where the nominal one is at the noise already.
    """


@dataclass(frozen=True)
class Evaluation:
    """What a result is worth on some recordings."""

    cell: str
    recordings: tuple[str, ...]
    windows: int
    """How many episodes or windows were compared."""
    models: Mapping[Model, Judged]
    left_out: tuple[LeftOut, ...]
    """Recordings that could not be compared, and why."""


def evaluate(cell: Cell, version: Path, episodes: Sequence[Episode], threads: int = 0) -> Evaluation:
    """Judge the result in a folder. Raises ConfigError for a result of another cell, DataError for unfit recordings."""
    result = from_json(read_result(version / "result.json", cell.name))
    fitted = current(cell, version, threads)
    cell = fitted.cell  # a result of `--parameters auto` has more parameters than the cell lists
    plain = fitted.simulator.with_effects([])
    known = {row.name: row for row in result.parameters}
    calibrated = np.array([known[p.name].calibrated if p.name in known else p.default for p in cell.parameters])
    models: dict[Model, Current] = {
        "nominal": Current(plain, plain.defaults),
        "calibrated": Current(plain, calibrated),
    }
    if fitted.simulator.effects:
        models["with_laws"] = fitted
    checked = check(cell, episodes)
    sound, without_motion = usable(cell, checked.episodes)
    data = recordings(cell, windows(cell, sound))
    noise = noise_of(cell, data)
    gaps = {}
    for name, model in models.items():
        simulator = model.simulator.driven(data.drives)
        gaps[name] = launched(simulator, data, noise, model.values).gap(model.values, noise.rms)
    judged = {name: Judged(gap, removed(gaps["nominal"], gap)) for name, gap in gaps.items()}
    left_out = (*checked.left_out, *without_motion)
    return Evaluation(cell.name, tuple(dict.fromkeys(data.recording)), len(data.names), judged, left_out)


def removed(nominal: Gap, gap: Gap) -> dict[str, float]:
    """Share of the excess over the floor that is gone, by signal: of mean squares, as noise adds to them."""

    def excess(of: Gap, name: str) -> float:
        return of.signals[name].rms ** 2 - of.signals[name].floor ** 2

    out = {}
    for name in gap.signals:
        before = excess(nominal, name)
        out[name] = 1 - excess(gap, name) / before if before > 0 else float("nan")
    return out

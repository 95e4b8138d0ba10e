"""The trace that every rival keeps in the same way."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from compass_ros.calibration.problem import Problem
from compass_ros.types import Estimate, Floats, Iteration, Progress, Report

_NO_GRAPH = np.zeros((0, 0))


@dataclass
class Record:
    """Counts rollouts and collects iterations while a rival runs."""

    name: str
    problem: Problem
    report: Report
    rollouts: int = 0
    trace: list[Iteration] = field(default_factory=list)
    cancelled: bool = False

    def spend(self, rollouts: int) -> None:
        self.rollouts += rollouts

    def measure(self, values: Floats) -> float:
        """Roll out the (P,) values on all episodes, add them to the trace, return the mean trajectory difference."""
        d = self.problem.mean_differences(values[None])[0]
        self.spend(len(self.problem.actions))
        return self.add(values, d)

    def add(self, values: Floats, difference: Floats) -> float:
        """Add (P,) values whose (K,) mean differences are already known and paid."""
        self.trace.append(Iteration(values.copy(), difference, _NO_GRAPH, self.rollouts))
        return float(difference.mean())

    def proceed(self, done: float) -> bool:
        """Tell the progress; remember and return whether to go on."""
        gap = float(self.trace[-1].difference.mean()) if self.trace else math.nan
        if not self.report(Progress(self.name, len(self.trace), min(done, 1.0), gap, math.nan)):
            self.cancelled = True
        return not self.cancelled

    def estimate(self, reason: str, *, values: Floats | None = None, std: Floats | None = None) -> Estimate:
        """The result; `values` is the best of the trace where a method does not say which one it stands by."""
        if values is None:
            values = min(self.trace, key=lambda entry: float(entry.difference.mean())).values
        nothing = np.full(len(values), np.nan)
        everything = np.ones(len(values), dtype=bool)
        return Estimate(
            self.name,
            values,
            nothing if std is None else std,
            everything,
            None,
            tuple(self.trace),
            self.rollouts,
            not self.cancelled,
            "cancelled" if self.cancelled else reason,
        )

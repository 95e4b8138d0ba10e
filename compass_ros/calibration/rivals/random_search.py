"""Random search: draw uniformly within the bounds, keep the best. The floor that any method must beat."""

from __future__ import annotations

import numpy as np

from compass_ros.calibration.problem import Allowance, Problem
from compass_ros.calibration.rivals.record import Record
from compass_ros.types import Estimate, Report


def random_search(problem: Problem, allowance: Allowance, seed: int, report: Report) -> Estimate:
    """Draws as many candidates as the allowance pays for on all episodes; the first guess is one of them."""
    generator = np.random.default_rng(seed)
    record = Record("random", problem, report)
    best = np.asarray(problem.start, dtype=np.float64)
    least = record.measure(best)
    per_iteration = max(allowance.per_iteration // len(problem.actions), 1)
    for i in range(allowance.iterations):
        drawn = problem.low + (problem.high - problem.low) * generator.random((per_iteration, len(best)))
        d = problem.mean_differences(drawn)
        record.spend(per_iteration * len(problem.actions))
        winner = int(np.argmin(d.mean(axis=1)))
        if d[winner].mean() < least:
            best, least = drawn[winner], float(d[winner].mean())
            record.add(best, d[winner])
        else:
            record.add(best, record.trace[-1].difference)
        if not record.proceed((i + 1) / allowance.iterations):
            break
    return record.estimate("the allowance is spent")

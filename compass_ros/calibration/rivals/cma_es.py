"""CMA-ES (package `cma`, Hansen's own) on the mean trajectory difference, within the bounds."""

from __future__ import annotations

import cma
import numpy as np

from compass_ros.calibration.problem import Allowance, Problem
from compass_ros.calibration.rivals.record import Record
from compass_ros.types import Estimate, Report

SIGMA = 0.5
"""First step size in half-widths of the randomisation. Chosen: the package leaves it to the user and advises a
quarter to a half of the range in which the optimum is expected."""


def cma_es(problem: Problem, allowance: Allowance, seed: int, report: Report) -> Estimate:
    """Coordinates are half-widths from the first guess; the population is the package's default, 4 + 3 ln P.

    Ends when the allowance is spent or the package's own stopping criteria hold. The trace has one entry for each
    iteration of the allowance: the best candidate so far.
    """
    record = Record("cma-es", problem, report)
    start, width = np.asarray(problem.start, dtype=np.float64), problem.half_width
    least = record.measure(start)
    best, best_d = start, record.trace[0].difference
    bounds = [((problem.low - start) / width).tolist(), ((problem.high - start) / width).tolist()]
    options = {"bounds": bounds, "seed": seed + 1, "verbose": -9}  # cma reads seed 0 as "take the clock"
    search = cma.CMAEvolutionStrategy(np.zeros(len(start)), SIGMA, options)
    episodes, limit = len(problem.actions), allowance.rollouts
    while not search.stop() and record.rollouts + search.popsize * episodes <= limit:
        asked = search.ask()
        candidates = np.clip(start + width * np.array(asked), problem.low, problem.high)
        d = problem.mean_differences(candidates)
        record.spend(len(candidates) * episodes)
        search.tell(asked, d.mean(axis=1).tolist())
        winner = int(np.argmin(d.mean(axis=1)))
        if d[winner].mean() < least:
            best, best_d, least = candidates[winner], d[winner], float(d[winner].mean())
        if record.rollouts >= len(record.trace) * allowance.per_iteration:
            record.add(best, best_d)
        if not record.proceed(record.rollouts / limit):
            break
    record.add(best, best_d)
    reasons = ", ".join(search.stop()) or "the allowance is spent"
    return record.estimate(reasons)

"""Which edges are true: interventions in the simulator, one parameter at a time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from compass_ros.calibration.problem import Problem
from compass_ros.calibration.randomization import randomise, randomised_box
from compass_ros.types import Bools, Floats

POINTS = 96
SHARE = 0.003
"""An edge is true where the parameter, moved alone, makes up this share of the variance of d_k in the randomised box:
lambda of the paper's table, the least share for which an edge pays in loss (2)."""


def total_effects(problem: Problem, seed: int = 0, points: int = POINTS) -> Floats:
    """(P, K) total-effect index of each parameter on each trajectory difference, within start +- half-width.

    Estimator of Jansen (1999): E[(d(x) - d(x with x_r drawn anew))^2] / 2 Var(d), the loss in mean squared error of
    the best possible prediction that does not know x_r. Costs points x (P + 1) rollouts.
    """
    random = np.random.default_rng(seed)
    everything = np.ones(len(problem.parameters), dtype=bool)
    box = randomised_box(problem.start, everything, problem.parameters)
    base, other = randomise(box, points, random), randomise(box, points, random)
    episodes = np.resize(problem.episodes, points)
    d = problem.differences(base, episodes)
    moved = np.repeat(base[None], len(problem.parameters), axis=0)
    for r in range(len(problem.parameters)):
        moved[r, :, r] = other[:, r]
    changed = problem.differences(moved.reshape(-1, base.shape[1]), np.tile(episodes, len(moved)))
    square = np.square(changed.reshape(len(moved), points, -1) - d).mean(axis=1)
    return np.asarray(square / np.maximum(2 * d.var(axis=0), 1e-300))


@dataclass(frozen=True)
class EdgeScore:
    """How well a graph agrees with the interventions."""

    kept: int
    """Parameters with at least one edge."""
    precision: float
    """Share of the kept edges that are true; NaN where none is kept."""
    recall: float
    """Share of the true edges that are kept; NaN where none is true."""
    missed: tuple[int, ...]
    """Parameters with a true edge and none kept."""
    extra: tuple[int, ...]
    """Parameters with a kept edge and none true."""


def score_edges(kept: Bools, true: Bools) -> EdgeScore:
    """Compare (P, K) kept edges with (P, K) true ones."""
    right = int((kept & true).sum())
    precision = right / int(kept.sum()) if kept.any() else float("nan")
    recall = right / int(true.sum()) if true.any() else float("nan")
    rows_kept, rows_true = kept.any(axis=1), true.any(axis=1)
    missed = tuple(np.flatnonzero(rows_true & ~rows_kept).tolist())
    extra = tuple(np.flatnonzero(rows_kept & ~rows_true).tolist())
    return EdgeScore(int(rows_kept.sum()), precision, recall, missed, extra)

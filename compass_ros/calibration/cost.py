"""What a fit minimises: half the robust sum of squares and half the prior's, at any points.

Robust weights after Huber in the smooth form of Charbonnier, rho(r) = 2 c^2 (sqrt(1 + r^2 / c^2) - 1), by iteratively
reweighted least squares.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from compass_ros.calibration.likelihood import Likelihood
from compass_ros.types import Floats

ROBUST = 4.0
"""Scale of the loss [sigma]: Gaussian noise is hardly touched, a swapped or lost frame hardly counts."""


@dataclass(frozen=True)
class Point:
    """Where a fit stands."""

    values: Floats
    """(P,) parameters."""
    launch: Floats
    """(E, A) offsets of the inputs."""
    cost: float
    """Half the robust sum of squares plus half the prior's; infinite before it was evaluated."""


def start(likelihood: Likelihood, values: Floats) -> Point:
    """A point at the commanded launches."""
    return Point(values, np.zeros_like(likelihood.inputs), np.inf)


def cost(likelihood: Likelihood, points: list[Point], robust: float) -> tuple[Floats, Floats]:
    """(N,) cost and (N, E, F, C) residual of each point, all rolled out in one batch."""
    episodes = len(likelihood.inputs)
    values = np.repeat(np.stack([p.values for p in points]), episodes, axis=0)
    inputs = np.concatenate([likelihood.inputs + p.launch for p in points])
    flat = likelihood.residual(values, inputs, np.tile(np.arange(episodes), len(points)))
    residual = flat.reshape(len(points), episodes, *flat.shape[1:])
    of_point = robust_loss(residual, robust).reshape(len(points), -1).sum(axis=1)
    return np.array([0.5 * c + _prior(likelihood, p) for c, p in zip(of_point, points, strict=True)]), residual


def robust_loss(residual: Floats, robust: float) -> Floats:
    """rho of each residual: its square where it is small beside the scale, twice the scale times it where large."""
    squared = residual**2
    return np.asarray(2 * squared / (np.sqrt(1 + squared / robust**2) + 1))  # stable for large scales


def robust_weight(residual: Floats, robust: float) -> Floats:
    """Factor of each squared residual that gives the robust loss's gradient: 1 where small, falling where large."""
    return np.asarray(1 / np.sqrt(1 + (residual / robust) ** 2))


def launches_away(likelihood: Likelihood, point: Point) -> Floats:
    """(E, a) launches that are not exact, in standard deviations of their prior."""
    random = likelihood.launch_std > 0
    return np.asarray(point.launch[:, random] / likelihood.launch_std[random])


def cost_by_episode(likelihood: Likelihood, point: Point, residual: Floats, robust: float) -> Floats:
    """(E,) what each episode adds to the cost: its (F, C) residuals and its launch."""
    of_frames = robust_loss(residual, robust).reshape(len(residual), -1).sum(axis=1)
    return np.asarray(0.5 * (of_frames + np.sum(launches_away(likelihood, point) ** 2, axis=1)))


def _prior(likelihood: Likelihood, point: Point) -> float:
    scaled = (point.values - likelihood.prior_mean) / likelihood.prior_std
    return 0.5 * float(np.sum(scaled**2) + np.sum(launches_away(likelihood, point) ** 2))

"""What a fit leaves unexplained, and how sure its parameters are in spite of it."""

from __future__ import annotations

import numpy as np

from compass_ros.calibration.cost import Point
from compass_ros.calibration.differences import Linear
from compass_ros.calibration.least_squares import Fit, normal_equations
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.noise import integrated_correlation_time
from compass_ros.types import Floats

FLOOR = 1.2
"""Mean square of a residual [sigma^2] up to which a fit is called at the noise floor: what else is in it is less than
half of the noise (rms)."""


def residual_at(likelihood: Likelihood, point: Point) -> Floats:
    """(E, F, C) residuals at a point."""
    episodes = np.arange(len(likelihood.inputs))
    return likelihood.residual(np.tile(point.values, (len(episodes), 1)), likelihood.inputs + point.launch, episodes)


def typical_residual(likelihood: Likelihood, point: Point) -> float:
    """Median size of a residual [sigma], scaled to a standard deviation; zero where nothing was measured."""
    seen = ~np.isnan(likelihood.measured)
    return float(np.median(np.abs(residual_at(likelihood, point)[seen]))) / 0.6745 if seen.any() else 0.0


def chi_square(likelihood: Likelihood, fit: Fit) -> float:
    """Mean squared residual, outliers clipped as the loss does, over the degrees of freedom that remain."""
    return _chi_square(residual_at(likelihood, fit.point), likelihood, fit)


def _chi_square(residual: Floats, likelihood: Likelihood, fit: Fit) -> float:
    squared = np.minimum(residual[~np.isnan(likelihood.measured)] ** 2, fit.robust**2)
    return float(np.sum(squared) / max(len(squared) - len(fit.free), 1))


def covariance(likelihood: Likelihood, fit: Fit) -> Floats:
    """(n, n) of free parameters, then launches, in the prior's standard deviations.

    The data's part of the Hessian is divided by what frames repeat of each other, in the noise or in the residual, and
    by the residual's variance where that is above the noise: what the model does not explain is no information about
    its parameters.
    """
    hessian, _ = normal_equations(likelihood, fit.point, fit.linear, fit.free, fit.robust)
    prior = np.eye(len(hessian))
    return np.asarray(np.linalg.inv((hessian - prior) * information_share(likelihood, fit) + prior))


def information_share(likelihood: Likelihood, fit: Fit) -> float:
    """What is left of the recordings' information where frames repeat each other or the model does not explain them.

    What the model does not explain is slow and small beside white noise: neighbours hardly show it, all lags together
    do.
    """
    residual = residual_at(likelihood, fit.point)
    clipped = np.clip(residual, -fit.robust, fit.robust)
    repeated = integrated_correlation_time(clipped, ~np.isnan(likelihood.measured))
    return 1 / (max(likelihood.correlation_time, repeated) * max(_chi_square(residual, likelihood, fit), 1.0))


def jackknife(likelihood: Likelihood, fit: Fit) -> Floats:
    """(p, p) covariance of the free parameters as the episodes disagree on them, in the prior's standard deviations.

    `covariance` believes that the formula is true and only the measurements are not. Where the formula is another than
    nature's, each episode pulls its quantities elsewhere, and a fit without that episode shows it: the jackknife that
    leaves out one group at a time (Tukey 1958), with whole episodes as groups. To first order, for no rollouts. Beside
    the prior, which is information too: along a direction of which the episodes say next to nothing it is the prior's.
    """
    episodes, p = len(likelihood.inputs), len(fit.free)
    parts = [_part_of(likelihood, fit, e) for e in range(episodes)]
    hessian = np.eye(p) + np.sum([part for part, _ in parts], axis=0)
    without = np.array([np.linalg.solve(hessian - part, pull) for part, pull in parts])
    away = without - without.mean(axis=0)
    found = (episodes - 1) / episodes * away.T @ away
    return np.asarray(found @ np.linalg.inv(np.eye(p) + found))


def variances(likelihood: Likelihood, fit: Fit) -> Floats:
    """(p,) of the free parameters, in the prior's: what the noise leaves, or what the episodes disagree on if more."""
    of_noise = np.diag(covariance(likelihood, fit))[: len(fit.free)]
    return np.maximum(of_noise, np.diag(jackknife(likelihood, fit)))


def _part_of(likelihood: Likelihood, fit: Fit, episode: int) -> tuple[Floats, Floats]:
    """(p, p) and (p,) one episode's part of the normal equations, its launch solved for; without the prior."""
    own, p, known = np.array([episode]), len(fit.free), fit.linear
    point = Point(fit.point.values, fit.point.launch[own], np.inf)
    linear = Linear(known.residual[own], known.jacobian[own], known.launch_jacobian[own], known.onset[own])
    hessian, gradient = normal_equations(likelihood.of(own), point, linear, fit.free, fit.robust)
    prior = ((point.values - likelihood.prior_mean) / likelihood.prior_std)[fit.free]
    carried = np.linalg.solve(hessian[p:, p:], hessian[p:, :p]).T
    part = hessian[:p, :p] - np.eye(p) - carried @ hessian[p:, :p]
    return part, gradient[:p] - prior - carried @ gradient[p:]

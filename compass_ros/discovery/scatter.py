"""Pushes that differ from one episode to the next: a deviation for each, and how far they spread.

The deviations are launches: unknown in each episode, around zero with a common standard deviation. That is what
maximises the marginal likelihood, by expectation and maximisation (Dempster, Laird and Rubin 1977).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.stats import f as f_distribution

from compass_ros.calibration.least_squares import Fit, Point, minimise
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.refine import settled
from compass_ros.calibration.residuals import covariance
from compass_ros.discovery.candidates import Candidate
from compass_ros.discovery.joint import Joint, from_second_start, widened
from compass_ros.discovery.screen import Space
from compass_ros.types import Floats, Ints

TURNS, ITERATIONS = 2, 5
"""How often deviations and their spread are found in turn before the fit is settled; steps of these fits."""
FIRST, LEAST = 10.0, 0.01
"""Spread to begin with, and the least, in the effect's scale."""
BY_CHANCE = 0.01
"""Probability of deviations that follow a number of the command so well; below, they are a law and no scatter."""


def fit_scattered(space: Space, scattered: Candidate, slight: float) -> Joint:
    """Some steps of parameters, deviations and their spread from the plain fit."""
    simulator, likelihood = widened(space.simulator, space.likelihood, (scattered.attached,))
    plain = space.fit
    spread = FIRST * scattered.attached.effect.quantities[0].scale
    launch = np.pad(plain.point.launch, ((0, 0), (0, 1)))
    point = Point(np.append(plain.point.values, spread), launch, np.inf)
    for _ in range(TURNS):
        likelihood, point = _spread(likelihood, point, spread)
        fit = minimise(likelihood, point, plain.free, ITERATIONS, plain.robust, slight)
        point, spread = fit.point, found_spread(likelihood, fit)
    likelihood, point = _spread(likelihood, point, spread)
    return Joint(simulator, likelihood, replace(fit, point=point), (scattered.attached,))


def settled_scatter(joint: Joint) -> Joint:
    """The same at its optimum, from two starts, and with the spread that is found there."""
    joint = from_second_start(joint)
    likelihood, point = _spread(joint.likelihood, joint.fit.point, found_spread(joint.likelihood, joint.fit))
    return replace(joint, likelihood=likelihood, fit=settled(likelihood, replace(joint.fit, point=point)))


def found_spread(likelihood: Likelihood, fit: Fit) -> float:
    """Standard deviation of the deviations: of what was found and of what is not known of it."""
    deviation = fit.point.launch[:, -1]
    launches = int(np.sum(likelihood.launch_std > 0))
    unsure = np.diag(covariance(likelihood, fit))[len(fit.free) + launches - 1 :: launches]
    return float(np.sqrt(np.mean(deviation**2 + unsure * likelihood.launch_std[-1] ** 2)))


def _spread(likelihood: Likelihood, point: Point, spread: float) -> tuple[Likelihood, Point]:
    """The same with deviations that spread so far."""
    quantity = likelihood.parameters[-1]
    spread = float(np.clip(spread, LEAST * quantity.half_width, quantity.high))
    mean, std, values = likelihood.prior_mean.copy(), likelihood.launch_std.copy(), point.values.copy()
    mean[-1] = std[-1] = values[-1] = spread
    return replace(likelihood, prior_mean=mean, launch_std=std), replace(point, values=values)


def spreads(joint: Joint) -> Ints:
    """Places of scattered effects among the values of a fit."""
    quantities = [a.effect.scattered for a in joint.simulator.effects for _ in a.effect.quantities]
    return len(joint.simulator.cell.parameters) + np.flatnonzero(quantities)


def follows_command(joint: Joint) -> bool:
    """Whether the deviations are no chance: those of a limit or a dead band bend with the commanded speed."""
    commanded = joint.likelihood.inputs[:, :-1]
    varied = commanded[:, np.ptp(commanded, axis=0) > 0]
    return bool(bent_by(varied, joint.fit.point.launch[:, -1]) < BY_CHANCE)


def bent_by(numbers: Floats, deviation: Floats) -> float:
    """Probability that some of k numbers (N, k) tell deviations (N,) so well by chance.

    F tests of a straight line and of a parabola in each number (Bonferroni); 1 where there are too few for those.
    """
    least = 1.0
    for column in numbers.T:
        for degree in (1, 2):
            free = len(deviation) - 1 - degree
            if free > 0:
                centred = column - np.mean(column)
                rest = deviation - np.polyval(np.polyfit(centred, deviation, degree), centred)
                ratio = (np.var(deviation) - np.var(rest)) / degree / (np.var(rest) / free)
                least = min(least, float(f_distribution.sf(ratio, degree, free)))
    return min(1.0, 2 * numbers.shape[1] * least)

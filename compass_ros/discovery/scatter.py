"""Laws that differ from one episode to the next by chance: a deviation of each, and how far they spread.

The deviations are numbers of an episode as its launch is: around zero with a common standard deviation, which is found
by expectation and maximisation (Dempster, Laird and Rubin 1977) and costs evidence for having been free.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from compass_ros.calibration.cost import Point
from compass_ros.calibration.launches import spreads
from compass_ros.calibration.least_squares import minimise
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.discovery.candidates import Candidate
from compass_ros.discovery.evidence import evidences, log_sum
from compass_ros.discovery.first_order import SIGMAS, Ranked
from compass_ros.discovery.hypothesis import SPREADS, Hypothesis, widened
from compass_ros.discovery.response import Response
from compass_ros.types import Floats

TURNS, ITERATIONS = 2, 4
"""How often deviations and their spread are found in turn; Gauss-Newton steps of each fit: a budget."""
LEAST = 0.01
"""Least spread, in the law's modest size."""


def ranked_scatter(response: Response, candidate: Candidate) -> Ranked:
    """A law of chance at the spread that has the highest evidence, to first order."""
    (quantity,) = candidate.attached.effect.quantities
    columns = _deviations(response, candidate, quantity.scale)
    tangent = response.tangent
    none = np.zeros((len(columns), 1))
    sizes = quantity.scale * np.array(SPREADS)
    logs = [
        evidences(
            replace(
                tangent,
                own=np.concatenate([tangent.own, size * columns], axis=2),
                own_away=np.concatenate([tangent.own_away, none], axis=1),
            ),
            [None],
        )[0].log
        for size in sizes
    ]
    gain = log_sum(np.array(logs)) - float(np.log(len(logs))) - evidences(tangent, [None])[0].log
    seen = quantity.high * float(np.linalg.norm(columns)) > SIGMAS
    return Ranked(candidate, sizes[[int(np.argmax(logs))]], columns[:, :, :0], gain, seen)


def _deviations(response: Response, candidate: Candidate, step: float) -> Floats:
    """(E, D, 1) change of the residual per deviation of an episode."""
    point, likelihood = response.fit.point, response.likelihood
    with_it = response.simulator.with_effects([*response.simulator.effects, candidate.attached])
    inputs = np.pad(likelihood.inputs + point.launch, ((0, 0), (0, 1)), constant_values=step)
    values = np.tile(np.append(point.values, step), (len(inputs), 1))
    predicted = with_it.observe(values, inputs, likelihood.time_s)
    there = np.nan_to_num(likelihood.difference(predicted, likelihood.measured) / likelihood.sigma)
    change = there.reshape(response.tangent.residual.shape) - response.tangent.residual
    return np.asarray(change[:, :, None] / step)


def with_scatter(parent: Hypothesis, ranked: Ranked) -> Hypothesis:
    """The parent's model fitted with a deviation of each episode beside."""
    attached = ranked.candidate.attached
    simulator, likelihood = widened(parent.simulator, parent.likelihood, [attached])
    spread, base = float(ranked.numbers[0]), parent.fit.point
    point = Point(np.append(base.values, spread), np.pad(base.launch, ((0, 0), (0, 1))), np.inf)
    for _ in range(TURNS):
        likelihood, point = _spread(likelihood, point, spread)
        fit = minimise(likelihood, point, parent.fit.free, ITERATIONS, parent.fit.robust, 1.0)
        point, spread = fit.point, float(spreads(likelihood, fit)[-1])
    return Hypothesis((*parent.laws, attached), simulator, likelihood, fit, without=parent.bare)


def _spread(likelihood: Likelihood, point: Point, spread: float) -> tuple[Likelihood, Point]:
    """The same with deviations that spread so far."""
    quantity = likelihood.parameters[-1]
    spread = float(np.clip(spread, LEAST * quantity.half_width, quantity.high))
    mean, std, values = likelihood.prior_mean.copy(), likelihood.launch_std.copy(), point.values.copy()
    mean[-1] = std[-1] = values[-1] = spread
    return replace(likelihood, prior_mean=mean, launch_std=std), replace(point, values=values)

"""Laws that differ from one episode to the next by chance: deviations of each, and how far they spread.

The deviations are numbers of an episode as its launch is: around zero with a standard deviation each, which is found
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
from compass_ros.discovery.evidence import log_mean
from compass_ros.discovery.first_order import SIGMAS, Ranked
from compass_ros.discovery.hypothesis import SPREADS, Hypothesis, widened
from compass_ros.discovery.response import Response
from compass_ros.discovery.sized import sized
from compass_ros.types import Floats

TURNS, ITERATIONS = 2, 4
"""How often deviations and their spread are found in turn; Gauss-Newton steps of each fit: a budget."""
LEAST = 0.01
"""Least spread, in the law's modest size."""


def ranked_scatter(response: Response, candidate: Candidate) -> Ranked:
    """A law of chance at the spread that has the highest evidence, to first order: the same for all its numbers, in
    their modest sizes."""
    modest = np.array([q.scale for q in candidate.attached.effect.quantities])
    columns = _deviations(response, candidate, modest)
    tangent = response.tangent
    none = np.zeros((len(columns), len(modest)))
    logs = [
        sized(
            replace(
                tangent,
                own=np.concatenate([tangent.own, spread * columns], axis=2),
                own_away=np.concatenate([tangent.own_away, none], axis=1),
            ),
            [None],
        )[0].log
        for spread in SPREADS
    ]
    gain = float(log_mean(logs)) - sized(tangent, [None])[0].log
    largest = max(q.high / q.scale for q in candidate.attached.effect.quantities)
    seen = largest * float(np.linalg.norm(columns)) > SIGMAS
    return Ranked(candidate, SPREADS[int(np.argmax(logs))] * modest, columns[:, :, :0], gain, seen)


def _deviations(response: Response, candidate: Candidate, modest: Floats) -> Floats:
    """(E, D, q) change of the residual by a modest deviation of an episode in each of the (q,) numbers."""
    likelihood, point = response.likelihood, response.fit.point
    with_it = response.simulator.with_effects([*response.simulator.effects, candidate.attached])
    values = np.tile(np.append(point.values, modest), (len(likelihood.inputs), 1))
    changes = []
    for one in np.diag(modest):
        inputs = np.concatenate([likelihood.inputs + point.launch, np.tile(one, (len(values), 1))], axis=1)
        predicted = with_it.observe(values, inputs, likelihood.time_s)
        there = np.nan_to_num(likelihood.difference(predicted, likelihood.measured) / likelihood.sigma)
        changes.append(there.reshape(response.tangent.residual.shape) - response.tangent.residual)
    return np.stack(changes, axis=2)


def with_scatter(parent: Hypothesis, ranked: Ranked) -> Hypothesis:
    """The parent's model fitted with deviations of each episode beside."""
    attached = ranked.candidate.attached
    simulator, likelihood = widened(parent.simulator, parent.likelihood, [attached])
    spread, base = ranked.numbers, parent.fit.point
    point = Point(np.append(base.values, spread), np.pad(base.launch, ((0, 0), (0, len(spread)))), np.inf)
    for _ in range(TURNS):
        likelihood, point = _spread(likelihood, point, spread)
        fit = minimise(likelihood, point, parent.fit.free, ITERATIONS, parent.fit.robust, 1.0)
        point, spread = fit.point, spreads(likelihood, fit)[-len(spread) :]
    return Hypothesis((*parent.laws, attached), simulator, likelihood, fit, without=parent.bare)


def _spread(likelihood: Likelihood, point: Point, spread: Floats) -> tuple[Likelihood, Point]:
    """The same with (q,) deviations that spread so far."""
    last = slice(-len(spread), None)
    quantities = likelihood.parameters[last]
    spread = np.clip(spread, [LEAST * q.half_width for q in quantities], [q.high for q in quantities])
    mean, std, values = likelihood.prior_mean.copy(), likelihood.launch_std.copy(), point.values.copy()
    mean[last] = std[last] = values[last] = spread
    return replace(likelihood, prior_mean=mean, launch_std=std), replace(point, values=values)

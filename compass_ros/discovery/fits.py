"""How a model with laws is fitted: from its parent's fit, or from the cell's first guess in a race."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from compass_ros.calibration.least_squares import Fit, Point, cost, difference_steps, extended, minimise
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.refine import Strongest, growing, settled, strongest
from compass_ros.calibration.residuals import typical_residual
from compass_ros.discovery.discrepancy import free
from compass_ros.discovery.evidence import solve
from compass_ros.discovery.first_order import WIDTH, Ranked
from compass_ros.discovery.hypothesis import Hypothesis, widened
from compass_ros.discovery.response import respond
from compass_ros.discovery.settings import PRIOR_UNKNOWN
from compass_ros.simulation.effects import Attached
from compass_ros.types import Floats, Ints

_SHARES = (0.15, 0.4, 0.7, 1.0)
"""Parts of the first-order step from which a fit begins, the best of them."""
EPISODES = 9
"""Episodes, or windows, to which the models of a race are fitted until it is over: a budget; of twelve recordings all
that are not held out."""
ETA = 3
"""One in so many goes on (Li et al. 2018, Hyperband: 3 or 4)."""
FEW = 5
"""Gauss-Newton steps of a fit that begins near its end."""
_SLIGHT = 0.3
"""Gain [log likelihood] of a step that is the last one: models are compared by whole units."""


def from_parent(parent: Hypothesis, ranked: Ranked, iterations: int) -> Hypothesis:
    """Fitted from the first-order solution about its parent's fit."""
    laws = ranked.candidate.parts
    simulator, likelihood = widened(parent.simulator, parent.likelihood, laws)
    amplitude = ranked.candidate.amplitudes
    found = solve_beside(parent, ranked)
    tuned, base = parent.fit.free, parent.fit.point
    starts = []
    for share in _SHARES:
        values = base.values.copy()
        values[tuned] += share * found * parent.likelihood.prior_std[tuned]
        numbers = np.where(amplitude, share * ranked.numbers, ranked.numbers)
        values = np.concatenate([values, numbers])
        starts.append(Point(np.clip(values, likelihood.low, likelihood.high), base.launch, np.inf))
    costs, residuals = cost(likelihood, starts, parent.fit.robust)
    best = int(np.argmin(costs))
    everything = np.concatenate([tuned, len(base.values) + np.arange(len(amplitude))])
    linear = extended(parent.fit.linear, likelihood, starts[best], residuals[best], everything)
    fit = minimise(likelihood, starts[best], everything, iterations, parent.fit.robust, 1.0, linear, fresh=False)
    return Hypothesis((*parent.laws, *laws), simulator, likelihood, fit, parent.response)


def solve_beside(parent: Hypothesis, ranked: Ranked) -> Floats:
    """(p,) first-order change of the parent's parameters beside a law at its first-order numbers."""
    tangent = parent.response.tangent
    sizes = np.array([WIDTH * q.scale for q in ranked.candidate.quantities if q.amplitude])
    moved = ranked.columns @ (ranked.numbers[ranked.candidate.amplitudes] / sizes)
    beside = replace(tangent, residual=tangent.residual + moved)
    change = np.zeros(len(parent.fit.free))
    change[parent.response.inside] = solve(beside, beside.normal, None).parameters
    return change


def race(parent: Hypothesis, starts: Sequence[tuple[tuple[Attached, ...], Floats]]) -> list[Hypothesis]:
    """The best two of models with one more law each, by successive halving over a growing horizon.

    A simulator without a law bends other parameters to stand for it, and from there a fit may end in a valley beside
    the right one. So the parent is fitted anew from the cell's first guess, to the beginning of some episodes and to
    more and more of them, until a free discrepancy is called for: the fit before that is not bent yet. From there each
    law goes on, the better third of them to the next horizon, and the last ones to all there is. `starts`: each law
    with its (q,) numbers.
    """
    count = len(parent.likelihood.inputs)
    rows = np.unique(np.linspace(0, count - 1, min(count, EPISODES)).astype(int))
    values, begun, horizons = _unbent(parent, rows)
    runners = [_runner(parent, laws, np.append(values, numbers), rows, begun, horizons)
               for laws, numbers in starts]  # fmt: skip
    alive = list(range(len(runners)))
    found: dict[int, Floats] = {}
    for _ in horizons:
        costs = {}
        for i in alive:
            _, fit = next(runners[i])
            costs[i], found[i] = fit.point.cost, fit.point.values
        alive = sorted(alive, key=lambda i: costs[i])[: max(len(alive) // ETA, 2)]
    return [_whole(parent, starts[i][0], found[i]) for i in alive] if horizons else []


def _unbent(parent: Hypothesis, rows: Ints) -> tuple[Floats, Strongest, tuple[float, ...]]:
    """(P,) of the parent's model fitted to the longest horizon that calls for nothing more, and the longer ones."""
    likelihood, first = parent.likelihood.of(rows), len(parent.simulator.cell.parameters)
    values = parent.likelihood.prior_mean.copy()
    values[first:] = parent.fit.point.values[first:]
    begun, shapes = strongest(likelihood, values), first + _shapes(parent.laws)
    horizons = likelihood.horizons
    for k, (part, fit) in enumerate(growing(likelihood, values, shapes, begun)):
        found = free(respond(parent.simulator, part, fit))
        if found.log + PRIOR_UNKNOWN > found.alone:
            return values, begun, horizons[k:]
        values = fit.point.values
    return values, begun, ()


def _shapes(laws: Sequence[Attached]) -> Ints:
    """Places of shapes among the numbers of laws."""
    return np.flatnonzero(~np.concatenate([np.empty(0, bool), *(a.amplitudes for a in laws)]))


def _runner(
    parent: Hypothesis,
    laws: Sequence[Attached],
    values: Floats,
    rows: Ints,
    begun: Strongest,
    horizons: tuple[float, ...],
) -> Iterator[tuple[Likelihood, Fit]]:
    """Fits of one model to some episodes, longer from one to the next; shapes stay as they are."""
    simulator, likelihood = widened(parent.simulator, parent.likelihood, laws)
    new = len(parent.fit.point.values) + np.flatnonzero(np.concatenate([a.amplitudes for a in laws]))
    held = len(simulator.cell.parameters) + _shapes((*parent.laws, *laws))
    begun = begun.beside(values, new, np.full(len(new), 1 / WIDTH))
    return growing(likelihood.of(rows), values, held, begun, horizons)


def _whole(parent: Hypothesis, laws: Sequence[Attached], values: Floats) -> Hypothesis:
    """A model fitted to all episodes from (P + q,) values, with the parent's parameters free."""
    simulator, likelihood = widened(parent.simulator, parent.likelihood, laws)
    own = np.arange(len(parent.fit.point.values), len(values))
    free = np.concatenate([parent.fit.free, own])
    steps = np.concatenate([difference_steps(parent.fit.linear), np.full(len(own), 1 / WIDTH)])
    point = Point(values, np.zeros_like(likelihood.inputs), np.inf)
    robust = max(parent.fit.robust, 3.0 * typical_residual(likelihood, point))
    fit = minimise(likelihood, point, free, FEW, robust, 3.0, steps=steps, fresh=False)
    fit = minimise(likelihood, fit.point, free, FEW, parent.fit.robust, _SLIGHT)
    return Hypothesis((*parent.laws, *laws), simulator, likelihood, fit)


def finished(hypothesis: Hypothesis) -> Hypothesis:
    """At its optimum, with exact differences there."""
    return replace(hypothesis, fit=settled(hypothesis.likelihood, hypothesis.fit), near=None)


def further(hypothesis: Hypothesis, iterations: int) -> Hypothesis:
    """Some more steps, with differences at the end."""
    fit = hypothesis.fit
    fit = minimise(hypothesis.likelihood, fit.point, fit.free, iterations, fit.robust, _SLIGHT, fit.linear)
    return replace(hypothesis, fit=fit, near=None)


def without(model: Hypothesis, laws: Sequence[Attached]) -> Hypothesis:
    """The same model fitted without some of its laws."""
    kept = [attached for attached in model.laws if attached not in laws]
    numbers = [np.arange(own.start, own.stop) for attached, own in model.own() if attached in kept]
    cell = len(model.simulator.cell.parameters)
    at = np.concatenate([np.arange(cell), *numbers])
    simulator = model.simulator.with_effects([a for a in model.simulator.effects if a not in laws])
    of_all = model.likelihood
    likelihood = replace(
        of_all,
        predict=simulator.observe,
        predict_alike=simulator.observe_alike,
        parameters=simulator.parameters,
        prior_mean=of_all.prior_mean[at],
        prior_std=of_all.prior_std[at],
    )
    point = replace(model.fit.point, values=model.fit.point.values[at], cost=np.inf)
    free = np.flatnonzero(np.isin(at, model.fit.free))
    fit = minimise(likelihood, point, free, FEW, model.fit.robust, _SLIGHT)
    return Hypothesis(tuple(kept), simulator, likelihood, fit)

"""How a model with laws is fitted: from its parent's fit, or from the cell's first guess in a race."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from compass_ros.calibration.cost import Point, cost, robust_loss
from compass_ros.calibration.differences import Linear, difference_steps, extended
from compass_ros.calibration.least_squares import minimise
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.refine import Strongest, growing
from compass_ros.calibration.residuals import typical_residual
from compass_ros.calibration.settle import settled
from compass_ros.discovery.first_order import WIDTH, Ranked
from compass_ros.discovery.hypothesis import Hypothesis, played, widened
from compass_ros.discovery.sized import best_parameters
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import Attached
from compass_ros.types import Floats, Ints

_SHARES = (0.15, 0.4, 0.7, 1.0)
"""Parts of the first-order step from which a fit begins, the best of them."""
TELLING = 300.0
"""Log evidence against the plain model in the episodes, or windows, to which the models of a race are fitted until it
is over: a budget. Where a hundredth of it decides, more recordings only cost time."""
LEAST = 3
"""Of these episodes, at least: as many as a verdict needs."""
FEW = 5
"""Gauss-Newton steps of a fit that begins near its end."""
_LAST = 0.3
"""Gain [log likelihood] of a step that is the last one: models are compared by whole units."""


@dataclass(frozen=True, eq=False)
class Begun:
    """A model with one law more, fitted to some episodes."""

    laws: tuple[Attached, ...]
    """The law, on each of its sites."""
    model: Hypothesis
    """Its parent's laws and this one, with the loss of its parent; its differences are the last of its fit."""
    bent: bool = True
    """Whether it began at its parent's fit, near which its parent's differences hold."""

    @property
    def point(self) -> Point:
        """Of these episodes: their launches, and half their robust sum of squares plus half the prior's."""
        return self.model.fit.point


def telling(parent: Hypothesis) -> Ints:
    """Episodes that hold enough against a model to tell others apart by; or all of them.

    Spread over all from the one that holds least against it to the one that holds most: a limit, a contact or a play
    may show in few of them.
    """
    count = len(parent.likelihood.inputs)
    loss = robust_loss(parent.response.tangent.residual, parent.fit.robust).sum(axis=1)
    against = (parent.free.log - parent.free.alone) * loss / float(loss.sum())
    order = np.argsort(against, kind="stable")
    for n in range(LEAST, count):
        rows = np.sort(order[np.unique(np.linspace(0, count - 1, n).astype(int))])
        if float(against[rows].sum()) >= TELLING:
            return np.asarray(rows)
    return np.arange(count)


def from_parent(parent: Hypothesis, ranked: Ranked, rows: Ints, iterations: int) -> Begun:
    """Fitted to some episodes from the first-order solution about its parent's fit."""
    laws = ranked.candidate.parts
    simulator, likelihood = widened(parent.simulator, parent.likelihood.of(rows), laws)
    amplitude, begins = ranked.candidate.amplitudes, ranked.candidate.begins
    found = solve_beside(parent, ranked)
    tuned, base = parent.fit.free, parent.fit.point
    starts = []
    for share in _SHARES:
        values = base.values.copy()
        values[tuned] += share * found * parent.likelihood.prior_std[tuned]
        numbers = np.where(amplitude, begins + share * (ranked.numbers - begins), ranked.numbers)
        values = np.concatenate([values, numbers])
        starts.append(Point(np.clip(values, likelihood.low, likelihood.high), base.launch[rows], np.inf))
    costs, residuals = cost(likelihood, starts, parent.fit.robust)
    best = int(np.argmin(costs))
    everything = np.concatenate([tuned, len(base.values) + np.arange(len(amplitude))])
    linear = extended(parent.fit.linear.of(rows), likelihood, starts[best], residuals[best], everything)
    fit = minimise(likelihood, starts[best], everything, iterations, parent.fit.robust, 1.0, linear, fresh=False)
    return Begun(laws, Hypothesis((*parent.laws, *laws), simulator, likelihood, fit, without=parent.bare[rows]))


def solve_beside(parent: Hypothesis, ranked: Ranked) -> Floats:
    """(p,) first-order change of the parent's parameters beside a law at its first-order numbers."""
    tangent = parent.response.tangent
    sizes = np.array([WIDTH * q.scale for q in ranked.candidate.quantities if q.amplitude])
    beyond = (ranked.numbers - ranked.candidate.begins)[ranked.candidate.amplitudes]
    moved = ranked.columns @ (beyond / sizes)
    beside = replace(tangent, residual=tangent.residual + moved)
    change = np.zeros(len(parent.fit.free))
    inside = parent.response.inside
    change[inside] = best_parameters(beside)[: len(inside)]
    return change


def with_law(parent: Hypothesis, values: Floats) -> tuple[Ints, Floats]:
    """What is free in a model with one law more, of (P + q,) values, and (p + q,) steps of its differences.

    All that is free in its parent, and the law, whose first steps are a modest size.
    """
    own = np.arange(len(parent.fit.point.values), len(values))
    steps = np.append(difference_steps(parent.fit.linear), np.full(len(own), 1 / WIDTH))
    return np.concatenate([parent.fit.free, own]), steps


def whole(parent: Hypothesis, one: Begun) -> Hypothesis:
    """A model fitted to all episodes, with exact differences at the end.

    One that began at its parent's fit goes on with the differences there as long as they hold. One that did not is
    fitted on a horizon that grows anew: a few episodes say little of most parameters.
    """
    simulator, likelihood = widened(parent.simulator, parent.likelihood, one.laws)
    free, steps = with_law(parent, one.point.values)
    if one.bent:
        point, linear = _near_parent(parent, one, likelihood, free, steps)
    else:
        point, linear = _grown(parent, one, likelihood, free, steps), None
    fit = minimise(likelihood, point, free, FEW, parent.fit.robust, _LAST, linear, steps=steps)
    return Hypothesis((*parent.laws, *one.laws), simulator, likelihood, fit, without=parent.bare)


def _near_parent(
    parent: Hypothesis, one: Begun, likelihood: Likelihood, free: Ints, steps: Floats
) -> tuple[Point, Linear | None]:
    """Where all episodes go on from a fit to some of them, and differences near it; None: they have to be taken."""
    point, linear = one.point, one.model.fit.linear
    if len(point.launch) < len(parent.likelihood.inputs):
        point = Point(point.values, parent.fit.point.launch, np.inf)
        (residual,) = cost(likelihood, [point], parent.fit.robust)[1]
        linear = extended(parent.fit.linear, likelihood, point, residual, free)
    robust = 3.0 * typical_residual(likelihood, point)
    if robust > parent.fit.robust:  # what these episodes did not hold is far off
        return minimise(likelihood, point, free, FEW, robust, 3.0, linear, fresh=False, steps=steps).point, None
    return point, linear


def _grown(parent: Hypothesis, one: Begun, likelihood: Likelihood, free: Ints, steps: Floats) -> Point:
    """All that is free fitted on a growing horizon of all episodes, shapes of the law that begins at last."""
    values = one.point.values
    wide = np.ones(len(values))
    wide[free] = steps
    held = len(parent.fit.point.values) + shapes(one.laws)
    *_, (_, fit) = growing(likelihood, values, held, Strongest(free, wide))
    return fit.point


def shapes(laws: Sequence[Attached]) -> Ints:
    """Places of shapes among the numbers of laws."""
    return np.flatnonzero(~np.concatenate([np.empty(0, bool), *(a.amplitudes for a in laws)]))


def finished(hypothesis: Hypothesis) -> Hypothesis:
    """At its optimum, with exact differences there."""
    return replace(hypothesis, fit=settled(hypothesis.likelihood, hypothesis.fit))


def without(model: Hypothesis, laws: Sequence[Attached]) -> Hypothesis:
    """The same model fitted without some of its laws."""
    simulator, likelihood, at = lacking(model, laws)
    point = replace(model.fit.point, values=model.fit.point.values[at], cost=np.inf)
    free = np.flatnonzero(np.isin(at, model.fit.free))
    linear = model.fit.linear.only(np.isin(model.fit.free, at))
    fit = minimise(likelihood, point, free, FEW, model.fit.robust, _LAST, linear)
    return Hypothesis(_kept(model, laws), simulator, likelihood, fit, without=model.bare)


def in_common(model: Hypothesis, own: Sequence[Attached], shared: Attached) -> Hypothesis:
    """The same model with one law on the sites of several, begun at the mean of their numbers."""
    without_them, of_rest, at = lacking(model, own)
    simulator, likelihood = widened(without_them, of_rest, [shared])
    numbers = np.mean([model.fit.point.values[place] for attached, place in model.own() if attached in own], axis=0)
    point = replace(model.fit.point, values=np.append(model.fit.point.values[at], numbers), cost=np.inf)
    free = np.append(np.flatnonzero(np.isin(at, model.fit.free)), len(at) + np.arange(len(numbers)))
    fit = minimise(likelihood, point, free, FEW, model.fit.robust, _LAST)
    return Hypothesis((*_kept(model, own), shared), simulator, likelihood, fit, without=model.bare)


def lacking(model: Hypothesis, laws: Sequence[Attached]) -> tuple[Simulator, Likelihood, Ints]:
    """Simulator and likelihood of a model without some of its laws, and the places of its values among the model's."""
    kept = _kept(model, laws)
    numbers = [np.arange(own.start, own.stop) for attached, own in model.own() if attached in kept]
    cell = len(model.simulator.cell.parameters)
    at = np.concatenate([np.arange(cell), *numbers])
    simulator = model.simulator.with_effects([a for a in model.simulator.effects if a not in laws])
    of_all = model.likelihood
    prior = {"prior_mean": of_all.prior_mean[at], "prior_std": of_all.prior_std[at]}
    return simulator, replace(played(of_all, simulator), **prior), at


def _kept(model: Hypothesis, laws: Sequence[Attached]) -> tuple[Attached, ...]:
    """A model's laws but for some."""
    return tuple(attached for attached in model.laws if attached not in laws)

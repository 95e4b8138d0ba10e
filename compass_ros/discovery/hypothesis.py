"""A model with laws, fitted together with all parameters: from its parent's fit, or from the cell's first guess."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from compass_ros.calibration.least_squares import Fit, Point, cost, extended, minimise
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.refine import freed, growing, settled
from compass_ros.calibration.residuals import variances
from compass_ros.discovery.discrepancy import Free, free, spread, with_law
from compass_ros.discovery.evidence import solve
from compass_ros.discovery.first_order import WIDTH, Ranked
from compass_ros.discovery.joint import widened
from compass_ros.discovery.response import Response, respond
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import Attached
from compass_ros.types import Floats, Ints

_SHARES = (0.15, 0.4, 0.7, 1.0)
"""Parts of the first-order step from which a fit begins, the best of them."""
EPISODES = 9
"""Episodes, or windows, to which the models of a race are fitted until it is over: a budget; of twelve recordings all
that are not held out."""
_SLIGHT = 0.3
"""Gain [log likelihood] of a step that is the last one: models are compared by whole units."""


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """A set of laws on sites, with its fit."""

    laws: tuple[Attached, ...]
    simulator: Simulator
    likelihood: Likelihood
    fit: Fit
    near: Response | None = None
    """The response of a fit nearby, whose pushes are taken for this one's; None: they are taken at this fit."""

    @property
    def name(self) -> str:
        said = (f"{a.effect.name}({', '.join(a.objects)})" if a.objects else a.effect.name for a in self.laws)
        return " + ".join(sorted(said)) or "none"

    @property
    def chi_square(self) -> float:
        return 2 * self.fit.point.cost / self.likelihood.measurements

    @cached_property
    def response(self) -> Response:
        if self.near is None:
            return respond(self.simulator, self.likelihood, self.fit)
        return replace(self.near, simulator=self.simulator, likelihood=self.likelihood, fit=self.fit)

    @cached_property
    def sizes(self) -> Floats:
        """(S,) rms of its laws along the fitted motion: accelerations, and errors of signals.

        What acts on contacts or commands counts as a push that moves the recordings as much as it does.
        """
        response, squared = self.response, np.zeros(len(self.response.unit))
        for attached, own in self.own():
            if attached.effect.forces is not None and attached.effect.moves:
                pushed = response.accelerations(attached, self.fit.point.values[own])
                squared += np.mean(pushed**2, axis=(0, 1))
                continue
            moved = self._moved(own, attached)
            if attached.effect.channel == "sensing":
                squared[len(response.site_of) :] += np.mean((moved * self.likelihood.sigma) ** 2, axis=(0, 1))
            else:
                squared += self._as_push(moved) ** 2
        return np.sqrt(squared)

    def _moved(self, own: slice, attached: Attached) -> Floats:
        """(E, F, C) what a law does to the recordings [sigma]."""
        values, point = self.fit.point.values.copy(), self.fit.point
        values[own] = np.where(attached.amplitudes, 0.0, values[own])
        episodes = np.arange(len(self.likelihood.inputs))
        tiled = np.tile(values, (len(episodes), 1))
        without = self.likelihood.residual(tiled, self.likelihood.inputs + point.launch, episodes)
        return without - self.fit.linear.residual

    def _as_push(self, moved: Floats) -> Floats:
        """(S,) accelerations, each in proportion to its motion's, that move the recordings together as much."""
        unit = self.response.unit * self.response.forces
        root = spread(self.response, unit)
        by_push = float(np.sum((self.response.tangent.pushes @ root) ** 2)) if root is not None else np.inf
        return np.asarray(unit * np.sqrt(np.sum(moved**2) / max(by_push, 1e-300)))

    @cached_property
    def free(self) -> Free:
        """With a discrepancy of any size beside its laws."""
        return free(self.response)

    @cached_property
    def _with_law(self) -> tuple[float, float]:
        return with_law(self.response, self.sizes)

    @property
    def log_evidence(self) -> float:
        """With a discrepancy in proportion to its laws; without laws, with none."""
        return self._with_law[0] if self.laws else self.free.alone

    @cached_property
    def std(self) -> Floats:
        """(P + Q,) standard deviations of parameters and laws; the prior's where the recordings say nothing.

        A law has the library's formula, which need not be nature's: what the episodes disagree on counts too.
        """
        std, free = self.likelihood.prior_std.copy(), self.fit.free
        std[free] *= np.sqrt(variances(self.likelihood, self.fit))
        return std

    def own(self) -> Iterator[tuple[Attached, slice]]:
        """Each of its laws with the place of its numbers among all values."""
        at = len(self.simulator.cell.parameters)
        for attached in self.laws:
            size = len(attached.effect.quantities)
            yield attached, slice(at, at + size)
            at += size

    @property
    def rho(self) -> float:
        """Posterior mean of the discrepancy's size, as a share of the laws' own."""
        return self._with_law[1] if self.laws else 0.0


def from_parent(parent: Hypothesis, ranked: Ranked, iterations: int) -> Hypothesis:
    """Fitted from the first-order solution about its parent's fit."""
    attached = ranked.candidate.attached
    simulator, likelihood = widened(parent.simulator, parent.likelihood, [attached])
    amplitude = attached.amplitudes
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
    return Hypothesis((*parent.laws, attached), simulator, likelihood, fit, parent.response)


def solve_beside(parent: Hypothesis, ranked: Ranked) -> Floats:
    """(p,) first-order change of the parent's parameters beside a law at its first-order numbers."""
    tangent = parent.response.tangent
    sizes = np.array([WIDTH * q.scale for q in ranked.candidate.attached.effect.quantities if q.amplitude])
    moved = ranked.columns @ (ranked.numbers[ranked.candidate.attached.amplitudes] / sizes)
    beside = replace(tangent, residual=tangent.residual + moved)
    change = np.zeros(len(parent.fit.free))
    change[parent.response.inside] = solve(beside, beside.normal, None).parameters
    return change


def race(parent: Hypothesis, starts: Sequence[tuple[Attached, Floats]]) -> list[Hypothesis]:
    """The best two of models with one more law each, fitted from the cell's first guess by successive halving.

    A simulator without a law has bent other parameters to stand for it, and from there a fit may end in a valley beside
    the right one. All models are fitted to the beginning of some episodes, the better half of them to more of it, and
    so on; the last ones to all there is. `starts`: each law with its (q,) numbers.
    """
    count = len(parent.likelihood.inputs)
    rows = np.unique(np.linspace(0, count - 1, min(count, EPISODES)).astype(int))
    runners = [_runner(parent, attached, numbers, rows) for attached, numbers in starts]
    alive = list(range(len(runners)))
    values: dict[int, Floats] = {}
    for _ in parent.likelihood.horizons:
        costs = {}
        for i in alive:
            _, fit = next(runners[i])
            costs[i], values[i] = fit.point.cost, fit.point.values
        alive = sorted(alive, key=lambda i: costs[i])[: max((len(alive) + 1) // 2, 2)]
    return [_whole(parent, starts[i][0], values[i]) for i in alive]


def _runner(
    parent: Hypothesis, attached: Attached, numbers: Floats, rows: Ints
) -> Iterator[tuple[Likelihood, Fit]]:
    """Fits of one model to some episodes, longer from one to the next; shapes stay as they are."""
    simulator, likelihood = widened(parent.simulator, parent.likelihood, [attached])
    values = np.concatenate([parent.likelihood.prior_mean, numbers])
    first, own = len(simulator.cell.parameters), len(parent.fit.point.values)
    values[first:own] = parent.fit.point.values[first:]
    amplitudes = np.concatenate([a.amplitudes for a in (*parent.laws, attached)])
    return growing(likelihood.of(rows), values, first + np.flatnonzero(~amplitudes))


def _whole(parent: Hypothesis, attached: Attached, values: Floats) -> Hypothesis:
    """A model fitted to all episodes from (P + q,) values."""
    simulator, likelihood = widened(parent.simulator, parent.likelihood, [attached])
    of_laws = np.arange(len(simulator.cell.parameters), len(values))
    point = Point(values, np.zeros_like(likelihood.inputs), np.inf)
    fit = freed(likelihood, point, 5, parent.fit.robust, of_laws)[1]
    fit = minimise(likelihood, fit.point, fit.free, 5, parent.fit.robust, _SLIGHT)
    return Hypothesis((*parent.laws, attached), simulator, likelihood, fit)


def finished(hypothesis: Hypothesis) -> Hypothesis:
    """At its optimum, with exact differences there."""
    return replace(hypothesis, fit=settled(hypothesis.likelihood, hypothesis.fit), near=None)


def further(hypothesis: Hypothesis, iterations: int) -> Hypothesis:
    """Some more steps, with differences at the end."""
    fit = hypothesis.fit
    fit = minimise(hypothesis.likelihood, fit.point, fit.free, iterations, fit.robust, _SLIGHT, fit.linear)
    return replace(hypothesis, fit=fit, near=None)

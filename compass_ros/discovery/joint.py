"""Parameters and effects fitted together, in the full simulator, from the first-order solution."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import islice

import numpy as np

from compass_ros.calibration.least_squares import (
    Fit,
    Point,
    cost,
    extended,
    minimise,
    normal_equations,
)
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.refine import ROBUST, freed, growing, settled
from compass_ros.calibration.residuals import jackknife
from compass_ros.discovery.screen import Score, Space
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import Attached, Quantity
from compass_ros.types import Floats, Ints

_SHARES = (0.0, 0.15, 0.4, 0.7, 1.0)
"""Parts of the first-order step that are tried as a start."""
ERROR_BARS = 2.0
"""Error bars from zero within which a law is not named: a 95 % interval that holds its absence."""
HALF = 4
"""Horizons after which fits from several starts are compared: half of the episode."""


@dataclass(frozen=True, eq=False)
class Joint:
    """A fit of the cell's parameters together with effects. Two are equal where they are the same object."""

    simulator: Simulator
    likelihood: Likelihood
    fit: Fit
    added: tuple[Attached, ...]
    """The effects of this fit."""
    converged: bool = False
    """With differences at the solution."""
    settled: bool = False
    """From two starts, and at its optimum."""

    @property
    def name(self) -> str:
        return "+".join(sorted(a.effect.name for a in self.added))

    @property
    def laws(self) -> tuple[Attached, ...]:
        """The same, as `next_shot.Rival` has them."""
        return self.added

    @property
    def stands_in(self) -> bool:
        """Whether a shape is not what the effect's name says: it stands for something else.

        A field as narrow as its range allows is none, a patch as wide as the table has one edge.
        """
        numbers = self.fit.point.values[len(self.simulator.cell.parameters) :]
        quantities = [q for attached in self.simulator.effects for q in attached.effect.quantities]
        least, most = widths(quantities), np.array([q.most for q in quantities])
        return bool(np.any(((least > 0) & (numbers <= least)) | (numbers >= most)))

    @cached_property
    def distinct(self) -> bool:
        """Whether each of its laws lies more than ERROR_BARS from zero, all its amplitudes together.

        Error bars as the noise leaves them, and as the episodes disagree. Along directions of which the recordings say
        less than the prior nothing is judged: where only ratios show, all numbers are unsure by one common factor, and
        none of them is near zero for that. A scatter is judged by its episodes.
        """
        free, p = self.fit.free, len(self.fit.free)
        hessian, _ = normal_equations(self.likelihood, self.fit.point, self.fit.linear, free, self.fit.robust)
        prior = np.eye(len(hessian))
        errors = np.linalg.inv((hessian - prior) / self.likelihood.correlation_time + prior)[:p, :p]
        told, axes = np.linalg.eigh(np.linalg.inv(errors) - np.eye(p))
        axes = axes[:, told > 1.0]
        away = ((self.fit.point.values - self.likelihood.prior_mean) / self.likelihood.prior_std)[free]
        bars = [axes.T @ cov @ axes for cov in (errors, jackknife(self.likelihood, self.fit))]
        at = len(self.simulator.cell.parameters)
        for attached in self.simulator.effects:
            own = np.isin(free, at + np.flatnonzero(attached.amplitudes))
            at += len(attached.effect.quantities)
            if not attached.effect.scattered and any(_within(away[own], axes[own] @ c @ axes[own].T) for c in bars):
                return False
        return True

    def log_evidence(self, correlation_time: float) -> float:
        """Laplace approximation in the prior's units, the data's part divided by the correlation time."""
        hessian, _ = normal_equations(self.likelihood, self.fit.point, self.fit.linear, self.fit.free, self.fit.robust)
        return -self.fit.point.cost / correlation_time - 0.5 * float(np.linalg.slogdet(hessian)[1])


def _within(away: Floats, errors: Floats) -> bool:
    """Whether (n,) amplitudes are within ERROR_BARS of zero, with their (n, n) errors."""
    return bool(away @ np.linalg.lstsq(errors, away, rcond=None)[0] < ERROR_BARS**2) and bool(np.any(errors))


def widths(quantities: Sequence[Quantity]) -> Floats:
    """(q,) least width of a field where a quantity is one [m]; zero for others."""
    return np.array([q.low if q.width else 0.0 for q in quantities])


def widened(simulator: Simulator, likelihood: Likelihood, added: Sequence[Attached]) -> tuple[Simulator, Likelihood]:
    """A simulator and likelihood with more effects; priors wide beside a modest effect, bounded by what is physical."""
    wider = simulator.with_effects([*simulator.effects, *added])
    quantities = [q for a in added for q in a.effect.quantities]
    mean = [0.0 if q.amplitude else q.start for q in quantities]
    std = [20 * q.scale if q.amplitude else (q.high - q.low) / 4 for q in quantities]
    more = sum(a.effect.scattered for a in added)
    return wider, replace(
        likelihood,
        predict=wider.observe,
        predict_alike=wider.observe_alike,
        parameters=wider.parameters,
        inputs=np.pad(likelihood.inputs, ((0, 0), (0, more))),
        launch_std=np.pad(likelihood.launch_std, (0, more)),
        prior_mean=np.concatenate([likelihood.prior_mean, mean]),
        prior_std=np.concatenate([likelihood.prior_std, std]),
    )


def fit_jointly(space: Space, scores: Sequence[Score], iterations: int, anew: bool = True) -> Joint:
    """Start from the first-order solution of one or more candidates and converge; `anew` as in `minimise`."""
    added = tuple(s.candidate.attached for s in scores)
    simulator, likelihood = widened(space.simulator, space.likelihood, added)
    numbers = np.concatenate([s.numbers for s in scores])
    step = _parameter_step(space, scores)
    base, free = space.fit.point, space.fit.free
    starts = []
    for share in _SHARES:
        values = base.values.copy()
        values[free] += share * step[: len(free)] * space.likelihood.prior_std[free]
        sizes = np.concatenate([_scaled(s, share) for s in scores])
        values = np.concatenate([values, sizes])
        starts.append(Point(np.clip(values, likelihood.low, likelihood.high), base.launch, np.inf))
    costs, residuals = cost(likelihood, starts, space.fit.robust)
    best = int(np.argmin(costs))
    start = starts[best]
    if best == 0:  # nothing but the smallest step helps: begin with it, amplitudes must not be exactly zero
        start = replace(starts[1], cost=np.inf)
    everything = np.concatenate([free, len(base.values) + np.arange(len(numbers))])
    linear = extended(space.fit.linear, likelihood, start, residuals[max(best, 1)], everything)
    fit = minimise(likelihood, start, everything, iterations, space.fit.robust, 1.0, linear, fresh=False, anew=anew)
    return Joint(simulator, likelihood, fit, added)


def converge(joint: Joint, slight: float, iterations: int = 8) -> Joint:
    """Until a step gains no more than is `slight` [log likelihood], with differences at the solution."""
    tolerance = max(0.3, slight)
    fit = minimise(
        joint.likelihood, joint.fit.point, joint.fit.free, iterations, joint.fit.robust, tolerance, joint.fit.linear
    )
    return replace(joint, fit=fit, converged=True)


def from_second_start(joint: Joint) -> Joint:
    """The better of a fit and another that begins at the cell's first guess, with the effects as they were found.

    Without its effects the simulator had bent other parameters to stand for them. From there, a fit with effects may
    end in a valley beside the right one.
    """
    if joint.settled:
        return joint
    values = joint.likelihood.prior_mean.copy()
    of_effects = np.arange(len(joint.simulator.cell.parameters), len(values))
    values[of_effects] = joint.fit.point.values[of_effects]
    fit = _grown(joint.simulator, joint.likelihood, values, joint.fit.robust)
    second = finished(replace(joint, fit=fit))
    if second.fit.point.cost > joint.fit.point.cost:
        return finished(joint)
    return second


def finished(joint: Joint) -> Joint:
    """A fit at its optimum."""
    if joint.settled:
        return joint
    return replace(joint, fit=settled(joint.likelihood, joint.fit), converged=True, settled=True)


def growth(space: Space, added: tuple[Attached, ...], numbers: Floats) -> Iterator[Joint]:
    """Fits on a growing horizon, from the cell's first guess and the (q,) numbers of effects, and of those there are.

    The strongest parameters are free, and the effects' amplitudes. The last one is of the whole episodes.
    """
    simulator, likelihood = widened(space.simulator, space.likelihood, added)
    values = likelihood.prior_mean.copy()
    there = np.arange(len(simulator.cell.parameters), len(space.fit.point.values))
    values[there] = space.fit.point.values[there]
    values[-len(numbers) :] = numbers
    for part, fit in growing(likelihood, values, _shapes(simulator)):
        yield Joint(simulator, part, fit, added)


def best_of(space: Space, starts: Sequence[tuple[tuple[Attached, ...], Floats]], kept: int) -> Iterator[Joint]:
    """Fits from the first guess of those `kept` of several effects, or numbers, that explain the first half best.

    Each is followed to the whole episodes when it is asked for.
    """
    growths = [growth(space, added, numbers) for added, numbers in starts]
    halves = [list(islice(grows, HALF))[-1] for grows in growths]
    left = [float(cost(half.likelihood, [half.fit.point], ROBUST)[0][0]) for half in halves]
    for i in np.argsort(left, kind="stable")[:kept]:
        *_, last = growths[i]
        yield _grown_up(last, space.fit.robust)


def _grown_up(joint: Joint, robust: float) -> Joint:
    """A fit that has grown to the whole episodes, with all that is felt free."""
    return replace(joint, fit=_freed(joint.simulator, joint.likelihood, joint.fit, robust))


def grown(joint: Joint, attached: Attached, simulator: Simulator, likelihood: Likelihood, robust: float) -> Joint:
    """A fit of one effect to the beginning of episodes, grown to the whole of them, perhaps on other objects.

    Simulator and likelihood are those without the effect.
    """
    wider, whole = widened(simulator, likelihood, (attached,))
    return Joint(wider, whole, _grown(wider, whole, joint.fit.point.values, robust), (attached,))


def _grown(simulator: Simulator, likelihood: Likelihood, values: Floats, robust: float) -> Fit:
    """A fit on a growing horizon, shapes as they are until it is whole, and then all that is felt free."""
    *_, (_, begun) = growing(likelihood, values, _shapes(simulator))
    return _freed(simulator, likelihood, begun, robust)


def _freed(simulator: Simulator, likelihood: Likelihood, begun: Fit, robust: float) -> Fit:
    """A fit with all free that is felt. The loss may have been wider; in the end it is the one that is asked for."""
    of_effects = np.arange(len(simulator.cell.parameters), len(begun.point.values))
    fit = freed(likelihood, begun.point, 5, robust, of_effects)[1]
    costs, residuals = cost(likelihood, [fit.point], robust)
    point, linear = replace(fit.point, cost=float(costs[0])), replace(fit.linear, residual=residuals[0])
    return replace(fit, point=point, linear=linear, robust=robust)


def _shapes(simulator: Simulator) -> Ints:
    """Indices of the effects' quantities that are no amplitudes."""
    first = len(simulator.cell.parameters)
    return first + np.flatnonzero([not q.amplitude for a in simulator.effects for q in a.effect.quantities])


def _scaled(score: Score, share: float) -> Floats:
    """(q,) numbers with the amplitudes at a share."""
    amplitude = np.array([q.amplitude for q in score.candidate.attached.effect.quantities])
    return np.where(amplitude, share * score.numbers, score.numbers)


def _parameter_step(space: Space, scores: Sequence[Score]) -> Floats:
    """(n,) first-order change of parameters (and launches) when the candidates take their part."""
    rest = space.residual + np.sum([s.tangent for s in scores], axis=0)
    gradient = space.parameters.T @ rest
    prior = (space.fit.point.values - space.likelihood.prior_mean)[space.fit.free]
    gradient[: len(prior)] += prior / space.likelihood.prior_std[space.fit.free]
    return np.asarray(-space.inverse @ gradient)

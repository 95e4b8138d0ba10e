"""Exact values of the parameters that matter: the simulator in the loop, on a horizon that grows.

A whole trajectory through several collisions has many minima; its beginning has one. So the fit starts with the
beginning of each episode and follows the solution as more is added. It starts with the parameters that move the
trajectories most, and frees the others, down to those that the recordings can just feel, when the whole episode fits.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from compass_ros.calibration.cost import ROBUST, Point, start
from compass_ros.calibration.differences import Linear, difference_steps, linearise
from compass_ros.calibration.identifiability import WIDER, alone
from compass_ros.calibration.launches import relaunched
from compass_ros.calibration.least_squares import NONE, Fit, minimise
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.residuals import chi_square, covariance, information_share, typical_residual
from compass_ros.calibration.roughness import with_rough_starts, with_roughness
from compass_ros.calibration.screen import WORTH, acting, coupling, independent, many
from compass_ros.calibration.settle import SETTLED, settled
from compass_ros.calibration.starts import crossed, draws, lost
from compass_ros.types import Floats, Ints

FELT = 2.0
"""A parameter is free where half a prior width of it moves all recordings together by more than this many sigma."""
STRONG = 60.0
"""The same for the first stage, in which the horizon grows."""
FELT_SHARE, STRONG_SHARE = 1e-3, 0.02
"""Of hundreds of parameters, these shares of the movement by all of them are asked for too; 0.055 is the root of the
share of variance that makes an edge."""
COARSE = 0.3
"""How far a parameter is moved to see whether it is felt, in prior widths."""

CALM = 300.0
"""Movement of a frame by one prior width [sigma] above which it is trusted less; ordinary shots stay below."""

ANEW = 3
"""How often a fit begins anew at most: a budget. Of a box that slides on a slope, begun at a friction of 0.42, the
fits end at 0.466, 0.472 and there."""

Watch = Callable[[str, float, Point], bool]
"""(stage, share of the refinement done, where it stands) -> whether to go on."""


@dataclass(frozen=True)
class Influence:
    """How parameters move all recordings together."""

    point: Point
    """Where that was asked."""
    strength: Floats
    """(P,) by one prior width [sigma]."""
    steps: Floats
    """(P,) for differences, in prior widths."""
    gram: Floats
    """(P, P) products of the changes; `strength` is the root of its diagonal."""
    changes: Floats
    """(E, F, C, P) of the observations by one prior width [m or rad]; 0 where nothing was measured."""
    onset: Floats
    """(E, P) as in `Linear`."""

    def felt(self, least: float, share: float) -> Ints:
        """Parameters that move the recordings by more than `least` sigma.

        Of hundreds: those that do so where the others cannot, and by this share of what all of them do.
        """
        if len(self.strength) < WORTH:
            return np.flatnonzero(self.strength > least)
        return independent(self.gram, max(least, share * float(np.linalg.norm(self.strength))))


@dataclass(frozen=True)
class Refined:
    """A maximum a posteriori with its local shape."""

    fit: Fit
    likelihood: Likelihood
    """The one that was maximised at last: its sigma holds the simulator's roughness."""
    covariance: Floats
    """(n, n) of free parameters, then launches, in units of the prior's standard deviations."""
    among: Floats
    """(p, p) the same of the free parameters, without what was screened out (nothing, where there are not hundreds)."""
    alone: Floats
    """(p,) standard deviation of each free parameter if the others' priors were wider (`identifiability.alone`)."""
    chi_square: float
    """Mean squared residual over what noise alone would leave; 1 = the noise floor."""
    influence: Influence
    """Of each parameter near the solution."""

    @property
    def asked(self) -> Ints:
        """Parameters that may be causes: all that move anything; of hundreds, those for which no other one stands."""
        return self.fit.free if many(self.likelihood) else np.flatnonzero(self.influence.strength > 0)


def refine(likelihood: Likelihood, values: Floats, watch: Watch = lambda *_: True) -> Refined:
    """Fit from the given (P,) values; where their beginning is not explained, from others too.

    Among a rough simulator's many small minima first states are bent to suit a parameter that is still wrong, and then
    hold it. Where roughness is most of sigma, the fit begins anew at the values that it found, with the first states as
    measured, as long as it ends lower.
    """
    found = _refined(likelihood, values, watch)
    for _ in range(ANEW):
        if found.likelihood.roughness**2 < 0.5 or not np.any(likelihood.launch_std):
            break
        again = _refined(likelihood, found.fit.point.values, watch)
        if not _surprise(again) < _surprise(found) - SETTLED:
            break
        found = again
    return found


def _surprise(refined: Refined) -> float:
    """Negative log posterior at a fit, but for a constant: sigma differs from one to another with what was rough."""
    likelihood = refined.likelihood
    return refined.fit.point.cost + float(np.sum(np.log(likelihood.sigma)[~np.isnan(likelihood.measured)]))


def _refined(likelihood: Likelihood, values: Floats, watch: Watch) -> Refined:
    """On a growing horizon, then with everything free that is felt."""
    likelihood = with_rough_starts(likelihood, start(likelihood, values))
    for stage, (_, fit) in enumerate(stages(likelihood, values), 1):
        if not watch("refine", 0.7 * stage / len(likelihood.horizons), fit.point):
            return polish(likelihood, fit.point, watch)
    return polish(calmed(likelihood, fit.linear), fit.point, watch)


def stages(likelihood: Likelihood, values: Floats) -> Iterator[tuple[Likelihood, Fit]]:
    """`growing` from these values, or from where the beginnings of several starts together lead (`starts`)."""
    strong = strongest(likelihood, values)
    alone = growing(likelihood, values, begun=strong)
    part, fit = next(alone)
    if not lost(part, fit.point):
        yield part, fit
        yield from alone
        return
    few, found = some(likelihood), [fit.point.values]
    for drawn in draws(likelihood, fit.free, values):
        _, other = next(growing(few, drawn, begun=strong))
        found.append(other.point.values)
    best = crossed(part, found, fit.robust)
    yield part, replace(fit, point=best)
    yield from growing(likelihood, best.values, horizons=likelihood.horizons[1:])


@dataclass(frozen=True)
class Strongest:
    """Parameters that a fit on a growing horizon begins with."""

    which: Ints
    """(s,) indices."""
    steps: Floats
    """(P,) for differences, in prior widths."""

    def beside(self, values: Floats, more: Ints, steps: Floats) -> Strongest:
        """The same, and (n,) `more` of the (P + q,) values of a wider model with their steps."""
        wide = np.ones(len(values))
        wide[: len(self.steps)] = self.steps
        wide[more] = steps
        return Strongest(np.concatenate([self.which, more]), wide)


def strongest(likelihood: Likelihood, values: Floats) -> Strongest:
    """Those that move the recordings most at (P,) values."""
    few = some(likelihood)
    first, share_asked = sensitivity(few, start(few, values)), len(few.inputs) / len(likelihood.inputs)
    return Strongest(first.felt(STRONG * np.sqrt(share_asked), STRONG_SHARE), first.steps.copy())


def growing(
    likelihood: Likelihood,
    values: Floats,
    held: Ints = NONE,
    begun: Strongest | None = None,
    horizons: tuple[float, ...] = (),
    linear: Linear | None = None,
) -> Iterator[tuple[Likelihood, Fit]]:
    """The beginning of each episode and the fit of the strongest parameters to it, longer from one to the next.

    Those `held` stay as they are until whole episodes are fitted: a beginning of half a second says nothing of a
    frequency. `begun`: the strongest ones, where they are known. `horizons`: other shares of the episodes than all that
    the likelihood has. `linear`: differences of the strongest near the values, to the first horizon, where these are
    known.
    """
    point = start(likelihood, values)
    begun = begun or strongest(likelihood, values)
    strong, steps, onset = np.setdiff1d(begun.which, held), begun.steps.copy(), None
    for share in horizons or likelihood.horizons:
        part = likelihood.until(share * float(likelihood.time_s.max()))
        robust = max(ROBUST, 3.0 * typical_residual(part, point))
        last = share == likelihood.horizons[-1]
        tolerance = 1.0 if last else 5.0
        if last and len(begun.which) > len(strong):
            strong, onset, linear = begun.which, None, None
        fit = minimise(part, point, strong, 4, robust, tolerance, linear, fresh=last, steps=steps[strong], onset=onset)
        point, steps[strong], onset, linear = fit.point, difference_steps(fit.linear), fit.linear.onset, None
        yield part, fit


def polish(likelihood: Likelihood, point: Point, watch: Watch = lambda *_: True) -> Refined:
    """Free everything that is felt, learn the simulator's roughness there, and fit once more.

    What is felt is asked here and not at the start, from where a puck may never have reached some wall.
    """
    influence, fit = freed(likelihood, point, 3)
    watch("refine", 0.85, fit.point)
    rough = with_roughness(likelihood, fit)
    linear = scaled(fit.linear, likelihood, rough)
    fit = settled(rough, replace(fit, linear=linear, robust=ROBUST))
    point = relaunched(rough, fit)
    if point.cost < fit.point.cost - SETTLED:
        fit = settled(rough, replace(fit, point=point))
    watch("refine", 1.0, fit.point)
    return concluded(rough, fit, influence)


def concluded(rough: Likelihood, fit: Fit, influence: Influence) -> Refined:
    """A fit with its errors; `rough`: the likelihood whose sigma holds the simulator's roughness."""
    spread, felt = covariance(rough, fit), fit.free
    among, coupled = spread[: len(felt), : len(felt)], np.ones(len(felt))
    if many(rough):
        share, factor = information_share(rough, fit), np.ones(len(spread))
        factor[: len(felt)] = coupling(influence.gram, felt, share)
        spread = spread * np.outer(factor, factor)
        coupled = coupling(influence.gram, felt, WIDER**2 * share)
    return Refined(fit, rough, spread, among, alone(among, coupled), chi_square(rough, fit), influence)


def freed(
    likelihood: Likelihood, point: Point, iterations: int, least: float = ROBUST, also: Ints = NONE
) -> tuple[Influence, Fit]:
    """Some steps with everything free that is felt at a point, and `also` these parameters.

    The robust loss is wider than `least` where the residual still is.
    """
    influence = sensitivity(likelihood, point)
    free = np.union1d(influence.felt(FELT, FELT_SHARE), also)
    robust = max(least, 3.0 * typical_residual(likelihood, point))
    steps = influence.steps[free]
    fit = minimise(
        likelihood, point, free, iterations, robust, 3.0, steps=steps, fresh=False, onset=influence.onset[:, free]
    )
    return influence, fit


def some(likelihood: Likelihood) -> Likelihood:
    """Which parameters are the strongest is asked of every second recording, or third: enough to begin with."""
    episodes, every = len(likelihood.inputs), 3 if many(likelihood) else 2
    return likelihood.of(np.arange(0, episodes, every)) if episodes >= 2 * every else likelihood


def calmed(likelihood: Likelihood, linear: Linear) -> Likelihood:
    """Trust frames less that the parameters move by more than CALM sigma per prior width.

    After an unlucky collision everything is amplified: the fit's errors, numerics, and physics that nobody asked about.
    Such frames say little about the parameters that other frames do not say better. Where half of the episodes are
    moved as much, it is what the parameters do, and no accident: a spring that swings for a while.
    """
    movement = np.sqrt(np.sum(linear.jacobian**2, axis=-1)).max(axis=-1)  # (E, F)
    largest = np.maximum.accumulate(movement, axis=1)
    amplified = largest / np.maximum(CALM, np.median(largest, axis=0))
    return replace(likelihood, sigma=likelihood.sigma * np.maximum(1.0, amplified)[:, :, None])


def scaled(linear: Linear, old: Likelihood, new: Likelihood) -> Linear:
    """Differences in the sigma of another likelihood of the same recordings."""
    share = old.sigma / new.sigma
    return replace(
        linear,
        residual=linear.residual * share,
        jacobian=linear.jacobian * share[..., None],
        launch_jacobian=linear.launch_jacobian * share[..., None],
    )


def sensitivity(likelihood: Likelihood, point: Point) -> Influence:
    """Influence of every parameter at a point, from one coarse difference each."""
    count = len(likelihood.parameters)
    strength, steps, gram = np.zeros(count), np.ones(count), np.zeros((count, count))
    changes = np.zeros((*likelihood.measured.shape, count))
    asked = np.flatnonzero(acting(likelihood, point, COARSE) & likelihood.tunable)
    coarse = linearise(likelihood, point, asked, np.full(len(asked), COARSE))
    strength[asked], steps[asked] = np.sqrt(np.sum(coarse.jacobian**2, axis=(0, 1, 2))), difference_steps(coarse)
    columns = coarse.jacobian.reshape(likelihood.measured.size, len(asked))
    gram[np.ix_(asked, asked)] = columns.T @ columns
    changes[..., asked] = coarse.jacobian * likelihood.sigma[..., None]
    onset = np.zeros((len(likelihood.inputs), count))
    onset[:, asked] = coarse.onset
    return Influence(point, strength, steps, gram, changes, onset)


def standard_errors(refined: Refined) -> tuple[Ints, Floats]:
    """Free parameters and one standard deviation of each, in their units."""
    free = refined.fit.free
    variance = np.diag(refined.covariance)[: len(free)]
    return free, np.sqrt(variance) * refined.likelihood.prior_std[free]

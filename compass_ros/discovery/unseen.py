"""Episodes that were never fitted: how surprising they are to a fitted model, beside what noise alone would be."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from scipy.linalg import block_diag

from compass_ros.calibration.least_squares import Fit, difference_steps, linearise, robust_loss, robust_weight
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.refine import (
    COARSE,
    FELT,
    FELT_SHARE,
    ROBUST,
    Refined,
    calmed,
    sensitivity,
    with_launches,
)
from compass_ros.calibration.residuals import covariance
from compass_ros.discovery.joint import Joint
from compass_ros.discovery.remainder import noise_cost, noise_level
from compass_ros.types import Floats, Ints

HELD_OUT_SHARE = 0.4
"""Share of the held-out excess that a model must remove where there is one."""
HELD_OUT_SEEN, BEYOND_SCATTER = 15.0, 2.0
"""Held-out excess from which it can be judged at all: log likelihood, and standard deviations of what noise makes."""
FLOOR = 1.2
"""Chi-square of a fit that leaves nothing to find in the episodes it was fitted to."""
UNEXPECTED = 0.05
"""Surprise beyond that of fitted episodes, a measurement [log likelihood], that is doubted.

Where nothing is missing it scatters by 0.016 (eight tables, three episodes of 2.5 s at 60 Hz). A false alarm costs a
second fit and no more.
"""


@dataclass(frozen=True)
class Untaught:
    """Parameters that these episodes feel and the fitted ones do not: those of a wall that no fitted shot met.

    What a model says of them is the cell's guess, and no model is to blame for it.
    """

    which: Ints
    """(k,) indices."""
    steps: Floats
    """(k,) for differences, in prior widths."""

    def beside(self, fit: Fit) -> Untaught:
        """Those that a fit leaves as they are."""
        kept = ~np.isin(self.which, fit.free)
        return Untaught(self.which[kept], self.steps[kept])


@dataclass(frozen=True)
class Prediction:
    """What a fitted model says of episodes that it has not seen."""

    surprise: float
    """Minus the log predictive density, up to a constant: noise and the fit's own uncertainty."""
    missed: float
    """Robust loss of the trajectories that it predicts with its best numbers."""


@dataclass(frozen=True)
class HeldOut:
    """Episodes that were never fitted, weighted as the fitted ones are."""

    likelihood: Likelihood
    untaught: Untaught
    plain: Prediction
    """Of the model without effects."""
    floor: float
    """Surprise by noise alone, of the kind that the fitted episodes have."""
    _asked: dict[Joint, Prediction] = field(default_factory=dict, repr=False)

    @property
    def before(self) -> float:
        """Surprise by the model without effects."""
        return self.plain.surprise

    @property
    def excess(self) -> float:
        """Surprise beyond that by noise alone."""
        return self.before - self.floor

    @property
    def seen(self) -> float:
        """Excess from which it can be judged: half the chi-square of N white values scatters by sqrt(N / 2)."""
        return max(HELD_OUT_SEEN, BEYOND_SCATTER * float(np.sqrt(0.5 * self.likelihood.measurements)))

    def prediction(self, joint: Joint) -> Prediction:
        """Of a fitted model; rolled out once for each."""
        if joint not in self._asked:
            self._asked[joint] = predict(self.likelihood, joint.likelihood, joint.fit, self.untaught)
        return self._asked[joint]

    def surprise(self, joint: Joint) -> float:
        """Minus the log predictive density of a fitted model."""
        return self.prediction(joint).surprise

    def share(self, joint: Joint) -> float:
        """Part of the held-out excess that a model removes; 1 where there is none to speak of."""
        return (self.before - self.surprise(joint)) / self.excess if self.excess > self.seen else 1.0

    def remainder(self, joint: Joint) -> float:
        """Excess of chi-square that a model leaves in these episodes."""
        return 2 * max(self.surprise(joint) - self.floor, 0.0) / self.likelihood.measurements

    def helps(self, joint: Joint) -> bool:
        """Whether a model predicts these episodes better: clearly, where there is something to gain.

        With its best numbers too: a model that is unsure of them is surprised by nothing.
        """
        if self.excess > self.seen:
            gained = self.plain.missed - self.prediction(joint).missed
            by_numbers = gained > HELD_OUT_SHARE * (self.plain.missed - self.floor)
            return by_numbers and self.share(joint) > HELD_OUT_SHARE
        return self.before - self.surprise(joint) > -5.0

    def beside(self, joint: Joint) -> HeldOut:
        """The same episodes, with another model as the one to surpass."""
        return replace(self, plain=self.prediction(joint))


def unexpected(judge: Likelihood, refined: Refined) -> bool:
    """Whether a fit that reaches the noise floor fails on episodes that it has not seen.

    Then those fitted do not show what is missing: parameters may stand for it in a few episodes, and not in others.
    """
    if refined.chi_square > FLOOR:
        return False
    fitted, fit = refined.likelihood, refined.fit
    usual = (fit.point.cost + 0.5 * len(fit.free)) / fitted.measurements  # outliers included
    return held_out(judge, fitted, fit).before > (usual + UNEXPECTED) * judge.measurements


def held_out(judge: Likelihood, fitted: Likelihood, fit: Fit) -> HeldOut:
    """Weigh held-out episodes: frames that the parameters move too much are trusted less, as in the fit."""
    untaught = _untaught(judge, fitted, fit)
    point = with_launches(judge, fit.point.values, untaught.which, untaught.steps)
    linear = linearise(judge, point, fit.free, difference_steps(fit.linear))
    calm = calmed(judge, linear)
    floor = noise_level(fitted, fit) * noise_cost(calm, fit.robust)
    return HeldOut(calm, untaught, predict(calm, fitted, fit, untaught), floor)


def _untaught(judge: Likelihood, fitted: Likelihood, fit: Fit) -> Untaught:
    influence = sensitivity(judge, with_launches(judge, fit.point.values))
    here = influence.felt(np.sqrt(2 * HELD_OUT_SEEN), FELT_SHARE)  # a prior width of these can be judged at all
    here = np.setdiff1d(here, fit.free)
    there = linearise(fitted, fit.point, here, np.full(len(here), COARSE))
    which = here[np.sqrt(np.sum(there.jacobian**2, axis=(0, 1, 2))) < FELT]
    return Untaught(which, influence.steps[which])


def predict(unseen: Likelihood, fitted: Likelihood, fit: Fit, untaught: Untaught) -> Prediction:
    """How surprising unseen episodes are to a fit, and how far it misses them.

    A model that is unsure what its parameters are may be wrong about an episode without being refuted by it: the
    residual has the covariance 1 + J C J', C that of the fitted parameters and of those `untaught`, which are fitted
    here. These, and launches that the cell does not know, are as likely as the cell says, and the volume that they
    take, the same for every model, is left out; that of a scatter which the model adds is not. Outliers are weighed
    down as in the fit.
    """
    judged, untaught = fitted.on(unseen), untaught.beside(fit)
    point = with_launches(judged, fit.point.values, untaught.which, untaught.steps)
    free = np.concatenate([fit.free, untaught.which])
    steps = np.concatenate([difference_steps(fit.linear), untaught.steps])
    linear = linearise(judged, point, free, steps)
    taught, p, random = len(fit.free), len(free), judged.launch_std > 0
    own = block_diag(*linear.launch_jacobian.reshape(len(judged.inputs), judged.measured[0].size, -1))
    residual = linear.residual.ravel()
    jacobian = np.hstack([linear.jacobian.reshape(len(residual), p), own])
    precision = np.eye(jacobian.shape[1])
    precision[:taught, :taught] = np.linalg.inv(covariance(fitted, fit)[:taught, :taught])
    moved = (point.values - judged.prior_mean)[untaught.which] / judged.prior_std[untaught.which]
    launched = (point.launch[:, random] / judged.launch_std[random]).ravel()
    away = np.concatenate([np.zeros(taught), moved, launched])
    left, weight = residual, np.ones_like(residual)
    for _ in range(3):
        weight = robust_weight(left, ROBUST)
        inner = precision + (jacobian * weight[:, None]).T @ jacobian
        move = -np.linalg.solve(inner, jacobian.T @ (weight * residual) + away)
        left = residual + jacobian @ move
    loss = 0.5 * float(np.sum(robust_loss(left, ROBUST)))
    of_cell = np.tile(np.cumsum(random[random]) <= np.sum(unseen.launch_std > 0), len(judged.inputs))
    same = np.concatenate([np.arange(taught, p), p + np.flatnonzero(of_cell)])
    common = inner[np.ix_(same, same)]
    volume = np.linalg.slogdet(inner)[1] - np.linalg.slogdet(common)[1] - np.linalg.slogdet(precision)[1]
    surprise = loss + 0.5 * float((away + move) @ precision @ (away + move)) + 0.5 * float(volume)
    return Prediction(surprise, 0.5 * float(np.sum(robust_loss(residual, ROBUST))))

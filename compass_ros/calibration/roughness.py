"""The simulator's own roughness, as a part of sigma.

Contacts begin in one time step or in the next, a box lands on one corner or on another: what small changes of the
parameters and of the first states do beyond a linear model is nothing that a fit could follow. It is noise, which the
differences must be long enough to see past.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from compass_ros.calibration.cost import Point
from compass_ros.calibration.differences import LAUNCH_STEP, difference_steps
from compass_ros.calibration.least_squares import Fit, minimise
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.types import Floats

SMALL = 0.3
"""Size of the changes that show roughness, in steps of the differences: curvature must not count."""
DRAWS = 6
"""Random changes that it is averaged over: a budget."""
REFITS = 8
"""Fits that show what another start is worth, a budget: the median absolute deviation has an efficiency of 0.37
(Rousseeuw and Croux 1993), so it is known to 1 / sqrt(2 x 0.37 x 8) = 0.41 of itself."""
STEPS = 4
"""Gauss-Newton steps of each, a budget: starts on a bar that are 98 to 381 worse (`gains_by_chance`) are at most 11.4
worse after four."""


def with_rough_starts(likelihood: Likelihood, point: Point) -> Likelihood:
    """Sigma with the roughness that small changes of the first states show, before anything was fitted.

    By second differences, which of three values that are rough by themselves have six times the variance of one.
    """
    moves = _launch_moves(likelihood, np.random.default_rng(0))
    if not moves.any():
        return likelihood
    values = np.tile(point.values, (DRAWS, 1))
    there, back = (_residuals(likelihood, values, point.launch + side * moves) for side in (1, -1))
    here = _residuals(likelihood, values[:1], point.launch)
    return _grown(likelihood, (there - 2 * here + back) / np.sqrt(6))


def with_roughness(likelihood: Likelihood, fit: Fit) -> Likelihood:
    """Sigma with the simulator's roughness around a fit, in place of what was known of it.

    Small random changes of the free parameters and first states must move the trajectories as the linear model says.
    """
    there, expected = _moved(likelihood, fit)
    return _grown(likelihood, there - expected)


def gains_by_chance(likelihood: Likelihood, fit: Fit) -> Floats:
    """(REFITS,) log likelihood that fits of the same model gain on this one (or lose) where they begin a little beside
    it: so may another model's fit that says nothing more, for it begins elsewhere too.

    Where landings are chance, a fit ends in one of many valleys. Of a bar on feet with nothing missing (`pushed_bar`
    1050001) starts that are 98 to 381 worse end from 11.4 worse to 9.6 better; of a ball that bounces 5 to 148 at 0.0.
    """
    rng = np.random.default_rng(0)
    values, _ = _beside(likelihood, fit, rng, REFITS)
    launches = fit.point.launch + _launch_moves(likelihood, rng, REFITS)
    gains = []
    for begun, launch in zip(values, launches, strict=True):
        there = Point(begun, launch, np.inf)
        again = minimise(likelihood, there, fit.free, STEPS, fit.robust, linear=fit.linear, fresh=False)
        gains.append(fit.point.cost - again.point.cost)
    return np.array(gains)


def _moved(likelihood: Likelihood, fit: Fit) -> tuple[Floats, Floats]:
    """(n, E, F, C) residuals [sigma] after small changes from a fit, and as its linear model expects them."""
    rng = np.random.default_rng(0)
    values, moves = _beside(likelihood, fit, rng, DRAWS)
    launches = _launch_moves(likelihood, rng)
    random = likelihood.launch_std > 0
    there = _residuals(likelihood, values, fit.point.launch + launches)
    expected = fit.linear.residual + np.einsum("efcp,np->nefc", fit.linear.jacobian, moves)
    shares = launches[..., random] / likelihood.launch_std[random]
    return there, expected + np.einsum("efcl,nel->nefc", fit.linear.launch_jacobian, shares)


def _beside(likelihood: Likelihood, fit: Fit, rng: np.random.Generator, draws: int) -> tuple[Floats, Floats]:
    """(n, P) values a little beside a fit, and (n, p) how far, in standard deviations of the priors."""
    free, steps = fit.free, difference_steps(fit.linear)
    moves = SMALL * rng.choice([-1.0, 1.0], (draws, len(free))) * steps / np.sqrt(len(free))
    values = np.tile(fit.point.values, (draws, 1))
    values[:, free] += moves * likelihood.prior_std[free]
    values = np.clip(values, likelihood.low, likelihood.high)
    return values, (values - fit.point.values)[:, free] / likelihood.prior_std[free]


def _launch_moves(likelihood: Likelihood, rng: np.random.Generator, draws: int = DRAWS) -> Floats:
    """(n, E, A) small changes of the first states."""
    drawn = rng.standard_normal((draws, *likelihood.inputs.shape))
    return np.asarray(SMALL * LAUNCH_STEP * drawn * likelihood.launch_std)


def _residuals(likelihood: Likelihood, values: Floats, launch: Floats) -> Floats:
    """(n, E, F, C) with (n, P) values and (n, E, A) launches."""
    episodes, numbers = likelihood.inputs.shape
    rows = len(values) * episodes  # a cell may have no inputs at all
    inputs = np.broadcast_to(likelihood.inputs + launch, (len(values), episodes, numbers)).reshape(rows, numbers)
    flat = likelihood.residual(np.repeat(values, episodes, axis=0), inputs, np.tile(np.arange(episodes), len(values)))
    return flat.reshape(len(values), episodes, *flat.shape[1:])


def _grown(likelihood: Likelihood, beyond: Floats) -> Likelihood:
    """The likelihood with the root mean square of (n, E, F, C) draws [sigma] as its roughness, which never heals."""
    spread = np.sqrt(np.mean(beyond**2, axis=0)) * likelihood.sigma
    rough = np.maximum.accumulate(spread, axis=1)
    known = 0.0 if likelihood.rough is None else likelihood.rough
    return replace(likelihood, sigma=np.sqrt(likelihood.sigma**2 - known**2 + rough**2), rough=rough)

"""How far launches spread over the episodes: random effects around what was commanded, or read off a track.

How wrong a reading is, is itself read off a few frames, and they do not show what happens between them. After the fit
the episodes say it together: they lie farther from what was read than was expected of them.
"""

from __future__ import annotations

import numpy as np
from scipy.special import chdtri

from compass_ros.calibration.cost import ROBUST, Point, cost, cost_by_episode, launches_away, start
from compass_ros.calibration.least_squares import NONE, Fit, minimise
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.residuals import covariance, typical_residual
from compass_ros.types import Floats

CHANCE = 1e-3
"""Probability with which readings that are as wrong as was expected are taken for worse ones: of a hundred calibrations
hardly one is done twice for nothing, as in `cells/start.py`."""
STEPS, OF_WINDOWS = 12, 2
"""Gauss-Newton steps for the launches, and for the first states of windows: within their noise the motion is linear in
these."""
_TOLD = 0.1
"""Least share of a launch that its own recording says, beside its prior; of what says less nothing is learnt."""


def with_launches(likelihood: Likelihood, values: Floats) -> Point:
    """(P,) values that stay as they are, each episode with the launch that agrees best with it.

    On a horizon that grows as the fit's does, and for its reason.
    """
    point = start(likelihood, values)
    if not likelihood.launch_std.any():
        return point
    most = OF_WINDOWS if likelihood.windowed else STEPS
    for share in likelihood.horizons:
        part = likelihood.until(share * float(likelihood.time_s.max()))
        robust = max(ROBUST, 3.0 * typical_residual(part, point))
        point = minimise(part, point, NONE, most, robust, tolerance=1.0, fresh=False).point
    return point


def relaunched(likelihood: Likelihood, fit: Fit) -> Point:
    """A fit's parameters, each episode with the better of two launches: the fit's, and the one that is found anew.

    Through a collision a launch has several minima, and one step with all episodes in it serves none of them well. So
    has the rate with which a window begins of a joint that dry friction holds: while the parameters were wrong, two of
    nine windows of an arm got 0.4 rad/s, and a fit does not come back from there over what the friction makes of less.
    """
    if not likelihood.launch_std.any():
        return fit.point
    anew = with_launches(likelihood, fit.point.values)
    costs, residuals = cost(likelihood, [fit.point, anew], fit.robust)
    known, other = (
        cost_by_episode(likelihood, p, r, fit.robust) for p, r in zip((fit.point, anew), residuals, strict=True)
    )
    launch = np.where((other < known)[:, None], anew.launch, fit.point.launch)
    return Point(fit.point.values, launch, float(costs[0] - np.sum(np.maximum(known - other, 0.0))))


def spreads(likelihood: Likelihood, fit: Fit) -> Floats:
    """(A,) standard deviation of what was found and of what is not known of it: a step of expectation and maximisation
    (Dempster, Laird and Rubin 1977)."""
    away, unsure = _launches(likelihood, fit)
    return _of_all(likelihood, np.sqrt(np.mean(away**2 + unsure, axis=0)))


def unexpected(likelihood: Likelihood, fit: Fit) -> Floats:
    """(A,) standard deviation of the launches that lie farther away than theirs allows; 0 of the others.

    By moments: a prior of standard deviation 1 draws in what the recording says to a share 1 - unsure of it.
    """
    away, unsure = _launches(likelihood, fit)
    told = np.maximum(1 - unsure, _TOLD)
    spread = np.sqrt(np.maximum(np.mean((away / told) ** 2 - unsure / told, axis=0), 0.0))
    beyond = (np.sum(away**2, axis=0) > chdtri(len(away), CHANCE)) & (spread > 1)
    return _of_all(likelihood, np.where(beyond, spread, 0.0))


def _launches(likelihood: Likelihood, fit: Fit) -> tuple[Floats, Floats]:
    """(E, a) launches that are not exact and (E, a) variances of their errors, in the prior's standard deviations."""
    away = launches_away(likelihood, fit.point)
    return away, np.diag(covariance(likelihood, fit))[len(fit.free) :].reshape(away.shape)


def _of_all(likelihood: Likelihood, spread: Floats) -> Floats:
    """(A,) of (a,) in the prior's standard deviations."""
    out = likelihood.launch_std.copy()
    out[out > 0] *= spread
    return out

"""Frames that the plain simulator has lost say little about what it lacks; they are trusted less.

What is missing bends a trajectory a little; then a collision multiplies that, and the rest of the shot is another one.
The distance there is large and says only that something happened before. A single such shot outweighs all others, and
any field of force at the right place mends it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.ndimage import median_filter

from compass_ros.calibration.least_squares import minimise
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.refine import Refined, chi_square, covariance, residual_at
from compass_ros.types import Floats

LOST = 4.0
"""Root mean square residual [sigma] from which a frame is trusted less: there it counts as so much."""
WINDOW = 9
"""Frames whose median that is: an outlier is no loss."""
TURNS = 2
"""How often the plain fit is repeated; without the lost frames it may follow others."""
SLIGHT = 2.0
"""Log likelihood that a further step of these fits must promise."""


def followed(refined: Refined) -> Refined:
    """The plain fit to what it can follow; the same object where it follows all."""
    likelihood, fit = refined.likelihood, refined.fit
    for _ in range(TURNS):
        doubt = doubted(refined.likelihood, residual_at(refined.likelihood, fit.point))
        if np.all(doubt == 1.0):
            return refined
        likelihood = replace(refined.likelihood, sigma=refined.likelihood.sigma * doubt[:, :, None])
        fit = minimise(likelihood, fit.point, fit.free, 6, fit.robust, SLIGHT)
    return replace(
        refined,
        fit=fit,
        likelihood=likelihood,
        covariance=covariance(likelihood, fit),
        chi_square=chi_square(likelihood, fit),
    )


def doubted(likelihood: Likelihood, residual: Floats) -> Floats:
    """(E, F) factors of sigma, from 1, that never fall in a shot: (E, F, C) residuals in sigma come down to LOST."""
    measured = ~np.isnan(likelihood.measured)
    squares = np.sum(np.where(measured, residual, 0.0) ** 2, axis=2)
    size = np.sqrt(squares / np.maximum(np.sum(measured, axis=2), 1))
    seen = np.where(measured.any(axis=2), np.arange(size.shape[1]), 0)  # frames without objects repeat the last one
    size = np.take_along_axis(size, np.maximum.accumulate(seen, axis=1), axis=1)
    typical = median_filter(size, size=(1, WINDOW), mode="nearest")
    return np.asarray(np.maximum.accumulate(np.maximum(typical / LOST, 1.0), axis=1))

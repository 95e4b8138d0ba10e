"""Frames that the plain simulator has lost say little about what it lacks; they are trusted less.

What is missing bends a trajectory a little; then a collision multiplies that, and the rest of the shot is another one.
The distance there is large and says only that something happened before. A single such shot outweighs all others, and
any field of force at the right place mends it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.ndimage import median_filter

from compass_ros.calibration.least_squares import Fit, minimise
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.residuals import residual_at
from compass_ros.types import Floats

LOST = 4.0
"""Root mean square residual [sigma] from which a frame is trusted less: there it counts as so much."""
WINDOW = 9
"""Frames whose median that is: an outlier is no loss."""
TURNS = 2
"""How often the plain fit is repeated; without the lost frames it may follow others."""
SLIGHT = 2.0
"""Log likelihood that a further step of these fits must promise."""


def followed(likelihood: Likelihood, fit: Fit) -> tuple[Likelihood, Fit]:
    """The plain fit to what it can follow, in weights that say what that is; the same objects where it follows all."""
    weighted = likelihood
    for turn in range(1, TURNS + 1):
        doubt = doubted(likelihood, residual_at(likelihood, fit.point))
        if np.all(doubt == 1.0):
            if weighted is not likelihood:  # the fit without some frames follows these too
                fit = minimise(likelihood, fit.point, fit.free, 6, fit.robust, SLIGHT)
            return likelihood, fit
        weighted = replace(likelihood, sigma=likelihood.sigma * doubt[:, :, None])
        fit = minimise(weighted, fit.point, fit.free, 6, fit.robust, SLIGHT, fresh=turn == TURNS)
    return weighted, fit


def doubted(likelihood: Likelihood, residual: Floats) -> Floats:
    """(E, F) factors of sigma, from 1, that never fall in a shot: (E, F, C) residuals in sigma come down to LOST."""
    measured = ~np.isnan(likelihood.measured)
    squares = np.sum(np.where(measured, residual, 0.0) ** 2, axis=2)
    size = np.sqrt(squares / np.maximum(np.sum(measured, axis=2), 1))
    seen = np.where(measured.any(axis=2), np.arange(size.shape[1]), 0)  # frames without objects repeat the last one
    size = np.take_along_axis(size, np.maximum.accumulate(seen, axis=1), axis=1)
    typical = median_filter(size, size=(1, WINDOW), mode="nearest")
    return np.asarray(np.maximum.accumulate(np.maximum(typical / LOST, 1.0), axis=1))

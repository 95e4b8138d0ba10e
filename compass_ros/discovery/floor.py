"""What is said where no effect stands out: that it is noise only if episodes that were never fitted say so too.

`none` means that what is left is noise. An error in held-out episodes of TWICE the noise floor is three quarters
something else in mean square, so it is never `none` beside it. It may be noise that neither stillness nor calm flight
show (frames that are lost, stamps that are a little off, blur); then the floor is higher than it was taken for. Or
something is missing for which no law stands.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from compass_ros.calibration.least_squares import Fit
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.noise import Noise, correlation_of
from compass_ros.calibration.residuals import residual_at
from compass_ros.types import Mismatch, Where

TWICE = 2.0
"""Held-out error over noise floor from which what is left is not called noise."""
EVERYWHERE = Where("all", "all", "all")


def shown_noise(noise: Noise, likelihood: Likelihood, fit: Fit) -> Noise:
    """The noise with what the fitted episodes show of it beyond what the recordings alone did.

    What a model misses follows the motion; in second differences of neighbouring frames it is gone, and what is left of
    white noise is 6 times its variance, of noise of correlation r (AR(1)) that less a share (4 r - r^2) / 3. Outliers
    count as far away as they are.
    """
    residual = residual_at(likelihood, fit.point)
    seen = ~np.isnan(likelihood.measured)
    missed = np.where(seen, residual * likelihood.sigma, np.nan)
    change = (missed[:, :-2] - 2 * missed[:, 1:-1] + missed[:, 2:]).reshape(-1, missed.shape[2])
    count = np.maximum(np.sum(~np.isnan(change), axis=0), 1)
    r = correlation_of(likelihood.correlation_time)
    known = noise.sigma**2 * (1 - (4 * r - r**2) / 3)
    more = np.maximum(np.nansum(change**2, axis=0) / (6 * count) - known, 0.0)
    return replace(noise, with_outliers=np.maximum(noise.rms, np.sqrt(noise.sigma**2 + more)))


def honest(mismatch: Mismatch, error: float, floor: float) -> Mismatch:
    """The answer as it may be published beside these numbers: `none` never beside an error of TWICE the floor."""
    if mismatch.verdict != "none" or error < TWICE * floor:
        return mismatch
    sentence = f"Something differs that no known law explains: held-out error {error / floor:.1f} times the noise."
    return replace(mismatch, verdict="unknown", where=EVERYWHERE, sentence=sentence)

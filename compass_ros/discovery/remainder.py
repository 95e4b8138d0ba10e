"""How much a model leaves unexplained, told from noise by its smoothness, not by a level that must be known."""

from __future__ import annotations

import numpy as np

from compass_ros.calibration.least_squares import Fit, Point, robust_loss, robust_weight
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.noise import autocovariance, correlation_of
from compass_ros.calibration.residuals import residual_at
from compass_ros.discovery.followed import doubted
from compass_ros.types import Floats

_LAGS = (1, 2, 3, 4)
"""Frames over which what is missing hardly changes."""
_MORE = 0.1
"""Share by which noise in motion must be above that at rest: of 6000 measurements it is known to 0.03."""


def smooth_excess(likelihood: Likelihood, point: Point, robust: float) -> float:
    """Mean square of what the model misses [sigma^2]: the residual's autocovariance beyond the noise's own.

    A residual is noise plus something that follows the motion. At a lag of some frames white noise is gone and the rest
    is still there; noise of correlation r (AR(1)) leaves r^lag. With N residuals the standard error is about
    1 / sqrt(4 N), where the residual's mean square is known no better than the noise.
    """
    residual = residual_at(likelihood, point)
    residual = residual * np.sqrt(robust_weight(residual, robust))  # as the robust loss counts it
    seen = ~np.isnan(likelihood.measured)
    correlation = correlation_of(likelihood.correlation_time)
    lags = [lag for lag in _LAGS if (seen[:, lag:] & seen[:, :-lag]).any()]
    return float(np.mean([autocovariance(residual, seen, lag) - correlation**lag for lag in lags])) if lags else 0.0


def noise_cost(likelihood: Likelihood, robust: float) -> float:
    """Cost that unit normal noise leaves under the robust loss."""
    measured = ~np.isnan(likelihood.measured)
    return _of_unit_noise(robust) * float(np.sum(_quiet(likelihood)[measured]))


def noise_level(likelihood: Likelihood, fit: Fit) -> float:
    """Cost of the noise in the fitted episodes, beside that of unit noise; at least 1.

    What a fit misses does not count. At rest nothing is seen of stamps that are a little off, and little of frames that
    are lost. Both change from one frame to the next, so they show in second differences, in which what follows the
    motion is gone, of frames that the fit can follow. Those of noise of correlation r (AR(1)) have 1 - (4 r - r^2) / 3
    of the variance of white noise; what is more is white.
    """
    residual = residual_at(likelihood, fit.point)
    seen = ~np.isnan(likelihood.measured) & (doubted(likelihood, residual) == 1.0)[:, :, None]
    three = seen[:, :-2] & seen[:, 1:-1] & seen[:, 2:]
    if not three.any():
        return 1.0
    change = (residual[:, :-2] - 2 * residual[:, 1:-1] + residual[:, 2:]) / np.sqrt(6)
    unit = _of_unit_noise(fit.robust) * float(np.mean(_quiet(likelihood)[:, 1:-1][three]))
    r = correlation_of(likelihood.correlation_time)
    found = 0.5 * float(np.mean(robust_loss(change, fit.robust)[three])) / unit
    more = found - 1 + (4 * r - r**2) / 3
    return 1.0 + more if more > _MORE else 1.0


def _of_unit_noise(robust: float) -> float:
    """Cost of one measurement with unit normal noise."""
    grid = np.linspace(-6, 6, 2001)
    density = np.exp(-0.5 * grid**2) / np.sqrt(2 * np.pi)
    return float(np.sum(density * 0.5 * robust_loss(grid, robust)) * (grid[1] - grid[0]))


def _quiet(likelihood: Likelihood) -> Floats:
    """(E, F, C) variance of the noise in sigma^2: less than 1 where sigma holds more than noise.

    Before any collision there is nothing but the tracker's noise.
    """
    return np.asarray(likelihood.sigma.min(axis=(0, 1)) ** 2 / likelihood.sigma**2)

"""How much a model leaves unexplained, told from noise by its smoothness, not by a level that must be known."""

from __future__ import annotations

import numpy as np

from compass_ros.calibration.least_squares import Point, robust_weight
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.noise import autocovariance, correlation_of
from compass_ros.calibration.residuals import residual_at

_LAGS = (1, 2, 3, 4)
"""Frames over which what is missing hardly changes."""


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

"""How exact the recordings are, from the recordings alone: still frames and straight flight, never the fit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from compass_ros.types import Floats

_MIN_STILL = 5
"""Frames before the command that an episode needs to count as still."""
_WORSE = 1.25
"""Flight noise over noise at rest from which motion counts as a source of noise (blur, stamps)."""
_WINDOW = 7
"""Frames of the local parabola that takes the motion out of a flight."""


@dataclass(frozen=True)
class Noise:
    """Measurement noise of the tracker."""

    sigma: Floats
    """(C,) standard deviation of one measurement [m or rad]."""
    correlation: float
    """Correlation of neighbouring frames, of an AR(1) process, 0 to below 1."""

    @property
    def correlation_time(self) -> float:
        """Frames that one independent measurement is worth."""
        return (1 + self.correlation) / (1 - self.correlation)


def measure_noise(time_s: Floats, measured: Floats, expected: float, stated: Floats | None = None) -> Noise:
    """From (E, F) times since the command and (E, F, C) measurements; `expected` [m] where neither can be measured.

    `stated`: (C,) what the sensor says of itself. It knows of errors that do not change from frame to frame, which no
    scatter shows, so the larger of both counts.
    """
    noise = _measured_noise(time_s, measured, expected)
    return noise if stated is None else Noise(np.maximum(noise.sigma, stated), noise.correlation)


def _measured_noise(time_s: Floats, measured: Floats, expected: float) -> Noise:
    still = _still_residuals(time_s, measured)
    flight = _flight_sigma(measured)
    columns = measured.shape[2]
    if still is None:
        return Noise(np.where(np.isnan(flight), expected, flight), 0.0)
    at_rest = np.sqrt(np.nanmean(np.square(_clipped(still)), axis=(0, 1))) * _small_sample(still)
    moving_is_worse = np.nan_to_num(flight) > _WORSE * at_rest
    sigma = np.where(moving_is_worse, flight, at_rest)
    clipped = np.clip(still, -3 * at_rest, 3 * at_rest)
    both = ~np.isnan(clipped[:, 1:]) & ~np.isnan(clipped[:, :-1])
    products = np.where(both, clipped[:, 1:] * clipped[:, :-1], 0).sum() / max(both.sum(), 1)
    correlation = float(products / max(np.nanmean(clipped**2), 1e-300))
    bias = 1.0 / max(np.sum(~np.isnan(still), axis=1).max(), 1)  # taking out each episode's mean lowers it by about 1/n
    return Noise(
        np.broadcast_to(np.maximum(sigma, 1e-6), (columns,)).copy(), float(np.clip(correlation + bias, 0.0, 0.95))
    )


def _still_residuals(time_s: Floats, measured: Floats) -> Floats | None:
    """(E, S, C) measurements before the command less each episode's mean; None where there are too few."""
    before = time_s < 0
    if before.sum(axis=1).min() < _MIN_STILL:
        return None
    still = np.where(before[:, :, None], measured, np.nan)[:, : int(before.sum(axis=1).max())]
    return np.asarray(still - np.nanmean(still, axis=1, keepdims=True))


def _clipped(still: Floats) -> Floats:
    """Outliers drawn in to 3.5 robust standard deviations of their column."""
    limit = 3.5 * 1.4826 * np.nanmedian(np.abs(still), axis=(0, 1))
    return np.asarray(np.clip(still, -limit, limit))


def _small_sample(still: Floats) -> float:
    """Undo what taking out the means costs: n / (n - 1) in variance."""
    frames = np.sum(~np.isnan(still[:, :, 0]), axis=1)
    return float(np.sqrt(np.mean(frames / np.maximum(frames - 1, 1))))


def _flight_sigma(measured: Floats) -> Floats:
    """(C,) robust deviation of the middle of seven frames from the parabola through the others.

    Frames with contacts are a minority and fall to the median. White noise only: correlated noise follows the parabola.
    """
    half = _WINDOW // 2
    offsets = np.arange(-half, half + 1, dtype=float)
    others = offsets != 0
    design = np.vander(offsets[others], 3, increasing=True)
    weights = np.linalg.pinv(design)[0]  # value of the parabola at the middle
    frames = measured.shape[1] - 2 * half
    if frames < 1:
        return np.full(measured.shape[2], np.nan)
    windows = np.stack([measured[:, i : i + frames] for i in range(_WINDOW)], axis=-1)
    deviation = windows[..., half] - windows[..., others] @ weights
    return np.asarray(1.4826 * np.nanmedian(np.abs(deviation), axis=(0, 1)) / np.sqrt(1 + np.sum(weights**2)))

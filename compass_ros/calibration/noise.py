"""How exact the recordings are, from the recordings alone: still frames and straight flight, never the fit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtri

from compass_ros.calibration.encoder import ROOT_12, encoder_step, repeats
from compass_ros.calibration.in_common import Bodies, of_its_own
from compass_ros.types import Bools, Floats

MOST_CORRELATED = 0.98
"""Beyond it, a residual says nothing of how often it was measured."""
_MIN_STILL = 5
"""Frames before the command that an episode needs to count as still."""
_WORSE = 1.25
"""Flight noise over noise at rest from which motion counts as a source of noise (blur, stamps)."""
LEAST_SHARE = 0.01
"""Least sigma, as a share of the cell's `noise_m`: no recording is known better, and no simulator is smoother.

Of 1 mm it is a hundredth of a millimetre, which is what the simulator is smooth to (docs/simulation.md).
"""
_WINDOW = 7
"""Frames of the local parabola that takes the motion out of a flight."""
_OWN = 0.5
"""Freedom of a window: neighbours share frames, and what the parabola takes from them."""
_CORRELATIONS = np.linspace(0.0, 0.95, 39)
_FOLLOWS = 0.2
"""Correlation from which flight says too little noise."""
_ALIKE = 0.99
"""Level of the test that the columns have one noise."""


@dataclass(frozen=True)
class Noise:
    """Measurement noise of a sensor."""

    sigma: Floats
    """(C,) standard deviation of one measurement, outliers drawn in [m or rad]; an encoder's rounding included."""
    correlation: float
    """Correlation of neighbouring frames, of an AR(1) process, 0 to below 1."""
    step: Floats | None = None
    """(C,) step of an encoder [m or rad], 0 where none was found; None: none anywhere."""
    with_outliers: Floats | None = None
    """(C,) root mean square of all that was seen of it, outliers as far away as they are; None: as `sigma`."""
    systematic: Floats | None = None
    """(C,) what the sensor states beyond its scatter [m or rad]: errors that frames do not average out; None: none."""

    @property
    def rms(self) -> Floats:
        """(C,) root mean square error of a measurement: what a simulator that is right leaves."""
        return self.sigma if self.with_outliers is None else np.maximum(self.sigma, self.with_outliers)

    @property
    def correlation_time(self) -> float:
        """Frames that one independent measurement is worth."""
        return correlation_time(self.correlation)

    def of(self, measured: Floats) -> Floats:
        """(E, F, C) standard deviations of such measurements.

        The rounding of an encoder that repeats a value is the same each time: all of them together are worth one, so in
        a row of n its variance counts n times.
        """
        sigma = np.broadcast_to(self.sigma, measured.shape)
        if self.step is None:
            return sigma.copy()
        again = repeats(measured, self.step) - 1
        return np.asarray(np.where(again > 0, np.hypot(sigma, np.sqrt(again) * self.step / ROOT_12), sigma))


def correlation_time(correlation: float) -> float:
    """Frames of an AR(1) process that one independent number is worth, from the correlation of neighbours."""
    return (1 + correlation) / (1 - correlation)


def correlation_of(time: float) -> float:
    """Correlation of neighbours from the correlation time."""
    return (time - 1) / (time + 1)


def integrated_correlation_time(residual: Floats, seen: Bools) -> float:
    """Frames that one independent number is worth in (E, F, C) residuals: 1 + 2 * the sum of the autocorrelation.

    The sum ends where two lags together are no longer positive (Geyer 1992, initial positive sequence).
    """
    variance = float(np.mean(residual[seen] ** 2)) if seen.any() else 1.0
    total = 1.0
    for lag in range(1, residual.shape[1] // 2, 2):
        pair = sum(autocovariance(residual, seen, k) for k in (lag, lag + 1)) / max(variance, 1e-300)
        if pair <= 0:
            break
        total += 2 * pair
    return float(np.clip(total, 1.0, correlation_time(MOST_CORRELATED)))


def autocovariance(residual: Floats, seen: Bools, lag: int) -> float:
    """Mean product of (E, F, C) residuals that are so many frames apart; 0 where no two were seen."""
    both = seen[:, lag:] & seen[:, :-lag]
    return float(np.mean((residual[:, lag:] * residual[:, :-lag])[both])) if both.any() else 0.0


def correlated(white: Floats, correlation: float) -> Floats:
    """(E, F, C) AR(1) noise of unit variance along the frames, from white noise."""
    out = white.copy()
    for frame in range(1, white.shape[1]):
        out[:, frame] = correlation * out[:, frame - 1] + np.sqrt(1 - correlation**2) * white[:, frame]
    return out


def measure_noise(
    time_s: Floats, measured: Floats, expected: float, stated: Floats | None = None, bodies: Bodies = ()
) -> Noise:
    """From (E, F) times since the command and (E, F, C) measurements; `expected` [m] where neither can be measured.

    `stated`: (C,) what the sensor says of itself. It knows of errors that do not change from frame to frame, which no
    scatter shows, so the larger of both counts; and so with an encoder's rounding, which stillness does not show.
    `bodies`: what these have in common is no noise (`in_common`).
    """
    least = LEAST_SHARE * expected
    step = np.array([encoder_step(list(column), ROOT_12 * least) for column in measured.transpose(2, 0, 1)])
    sigma, beyond, correlation = _scatter(time_s, measured, bodies, expected, least)
    with_outliers = np.hypot(sigma, beyond)
    sigma = np.maximum(sigma, np.maximum(step / ROOT_12, least))
    systematic = None
    if stated is not None and np.any(stated > sigma):
        systematic = np.sqrt(np.maximum(np.maximum(stated, 0.0) ** 2 - sigma**2, 0.0))
        sigma = np.maximum(sigma, stated)
    return Noise(sigma, correlation, step if step.any() else None, with_outliers, systematic)


def _scatter(
    time_s: Floats, measured: Floats, bodies: Bodies, expected: float, least: float
) -> tuple[Floats, Floats, float]:
    """(C,) standard deviation, (C,) rms of what is beyond the outliers' limit, correlation of neighbours."""
    still = _still_residuals(time_s, measured)
    if still is None:
        flight, beyond, _ = _flight_noise(measured, bodies)
        return np.where(np.isnan(flight), expected, flight), beyond, 0.0
    still = of_its_own(still, bodies, _at_rest(still)[1])
    at_rest, correlation = _at_rest(still)
    repeated = correlation_time(correlation)
    flight, beyond, of_flight = _flight_noise(np.where(time_s[:, :, None] < 0, np.nan, measured), bodies)
    beyond = np.fmax(beyond, np.sqrt(np.nanmean(np.square(still) - np.square(_clipped(still)), axis=(0, 1))))
    if correlation > _FOLLOWS:
        of_flight = np.zeros_like(of_flight)
    of_rest = (np.sum(~np.isnan(still), axis=(0, 1)) - len(still)) / repeated
    both = np.sqrt((of_rest * at_rest**2 + of_flight * np.nan_to_num(flight) ** 2) / (of_rest + of_flight))
    moving_is_worse = np.nan_to_num(flight) > _WORSE * at_rest
    sigma = np.where(moving_is_worse, flight, both)
    freedom = np.where(moving_is_worse, np.maximum(of_flight, 1.0), of_rest + of_flight)
    return _pooled(np.maximum(sigma, least), freedom), beyond, correlation


def _at_rest(still: Floats) -> tuple[Floats, float]:
    """(C,) standard deviation, and correlation of neighbours, of an AR(1) process seen less each episode's mean.

    Taking out the mean of n frames lowers both. What they come to is known exactly, so that it can be undone.
    """
    frames = max(round(float(np.mean(np.sum(~np.isnan(still[:, :, 0]), axis=1)))), 3)
    spread = np.sqrt(np.nanmean(np.square(_clipped(still)), axis=(0, 1)))
    clipped = np.clip(still, -3 * spread, 3 * spread)
    both = ~np.isnan(clipped[:, 1:]) & ~np.isnan(clipped[:, :-1])
    products = np.where(both, clipped[:, 1:] * clipped[:, :-1], 0).sum() / max(both.sum(), 1)
    found = products / max(float(np.nanmean(clipped**2)), 1e-300)
    apart = np.abs(np.subtract.outer(np.arange(frames), np.arange(frames)))
    centre = np.eye(frames) - 1 / frames
    left = [centre @ rho**apart @ centre for rho in _CORRELATIONS]
    variances = np.array([np.mean(np.diag(c)) for c in left])
    neighbours = np.array([np.mean(np.diag(c, 1)) for c in left]) / variances
    correlation = float(np.interp(found, neighbours, _CORRELATIONS))
    return spread / np.sqrt(np.interp(correlation, _CORRELATIONS, variances)), correlation


def _pooled(sigma: Floats, freedom: Floats) -> Floats:
    """(C,) one value for all columns where Bartlett's test (1937) does not tell them apart."""
    total = float(np.sum(freedom))
    common = float(np.sum(freedom * sigma**2) / total)
    statistic = total * np.log(common) - float(np.sum(freedom * np.log(sigma**2)))
    alike = statistic < chdtri(max(len(sigma) - 1, 1), 1 - _ALIKE)
    return np.full(len(sigma), np.sqrt(common)) if alike else sigma


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


def _flight_noise(measured: Floats, bodies: Bodies) -> tuple[Floats, Floats, Floats]:
    """(C,) standard deviation by the middle of seven frames against the parabola through the others; (C,) the rms of
    what is beyond the outliers' limit, (C,) the freedom of the first.

    Only the calmer half of the windows counts, by what the other six leave of their parabola: that keeps contacts out,
    and of a window's normal noise it says nothing about the middle. For white noise: correlated noise follows the
    parabola.
    """
    half = _WINDOW // 2
    offsets = np.arange(-half, half + 1, dtype=float)
    others = offsets != 0
    design = np.vander(offsets[others], 3, increasing=True)
    weights = np.linalg.pinv(design)[0]  # value of the parabola at the middle
    frames, columns = measured.shape[1] - 2 * half, measured.shape[2]
    if frames < 1:
        return np.full(columns, np.nan), np.zeros(columns), np.zeros(columns)
    windows = np.stack([measured[:, i : i + frames] for i in range(_WINDOW)], axis=-1)
    around = windows[..., others]
    deviation = windows[..., half] - around @ weights
    rough = np.sum((around - around @ (design @ np.linalg.pinv(design)).T) ** 2, axis=-1)
    out, beyond, freedom = np.full(columns, np.nan), np.zeros(columns), np.zeros(columns)
    seen = ~np.isnan(rough) & ~np.isnan(deviation)
    calm = seen & (rough <= np.nanmedian(np.where(seen, rough, np.nan), axis=(0, 1)))
    without_contacts = _clipped(deviation)
    deviation += of_its_own(without_contacts, bodies, apart=_WINDOW) - without_contacts
    for c in range(columns):
        chosen = deviation[..., c][calm[..., c] & ~np.isnan(deviation[..., c])]
        if not len(chosen):
            continue
        limit = 3.5 * 1.4826 * np.median(np.abs(chosen))
        drawn_in = np.clip(chosen, -limit, limit)
        out[c] = np.sqrt(np.mean(drawn_in**2) / (1 + np.sum(weights**2)))
        beyond[c] = np.sqrt(np.mean(chosen**2 - drawn_in**2))  # the middle's own: the others were found to be calm
        freedom[c] = len(chosen) * _OWN
    return out, beyond, freedom

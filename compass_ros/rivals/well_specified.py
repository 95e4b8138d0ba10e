"""Observed and simulated data for sbi's misspecification check: residuals of the calibrated simulator, shot by shot.

A shot is the residual in units of the noise, averaged over BLOCKS parts of its time. Simulated shots have parameters
from the calibration's covariance and noise like the tracker's, so a well specified simulator makes both alike.
"""

from __future__ import annotations

import numpy as np

from compass_ros.calibration.noise import Noise, correlated
from compass_ros.rivals.calibrated import Calibrated, Shots
from compass_ros.types import Floats

BLOCKS = 10
DRAWS = 60
"""Sets of parameters that are rolled out on all shots."""


def observed_and_simulated(given: Calibrated, seed: int, draws: int = DRAWS) -> tuple[Floats, Floats]:
    """(E, d) recorded shots, fitted and held out, and (draws E, d) simulated ones."""
    rng = np.random.default_rng([seed, 1])
    low, high = (np.array([getattr(p, side) for p in given.simulator.cell.parameters]) for side in ("low", "high"))
    z = rng.standard_normal((draws, given.spread.shape[1]))
    values = np.clip(given.values + z @ given.spread.T, low, high)
    seen: list[Floats] = []
    made: list[Floats] = []
    for shots in (given.fit, given.held_out):
        seen.append(_features(shots.residual, given.noise))
        made.extend(_features(_again(given, shots, row, rng), given.noise) for row in values)
    return np.concatenate(seen), np.concatenate(made)


def _again(given: Calibrated, shots: Shots, values: Floats, rng: np.random.Generator) -> Floats:
    """(E, F, C) residuals of a recording that the simulator itself could have made; NaN where nothing was seen."""
    moved = given.predict(given.simulator, values, shots.data) - shots.predicted
    return np.where(np.isnan(shots.data.measured), np.nan, moved + _noise(given.noise, moved.shape, rng))


def _noise(noise: Noise, shape: tuple[int, ...], rng: np.random.Generator) -> Floats:
    """(E, F, C) AR(1) noise of the measured size and correlation [m]."""
    return correlated(rng.standard_normal(shape), noise.correlation) * noise.sigma


def _features(residual: Floats, noise: Noise) -> Floats:
    """(E, BLOCKS C) means over parts of the time, in units of the noise; 0 where nothing was seen."""
    parts = np.array_split(residual / noise.sigma, BLOCKS, axis=1)
    seen = [(~np.isnan(p)).sum(axis=1) for p in parts]
    means = [np.nansum(p, axis=1) / np.maximum(s, 1) for p, s in zip(parts, seen, strict=True)]
    return np.concatenate(means, axis=1)

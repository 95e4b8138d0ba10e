"""A Gaussian process on what the calibrated simulator leaves: predicts better, names nothing.

One process a body, with scikit-learn: residual in x and y over the simulated place, velocity and time since the body
was first struck; Gaussian kernel with a length for each of the five, white noise. What it is asked on held-out episodes
are simulated states, so nothing of their recordings is used.
"""

from __future__ import annotations

import warnings
from itertools import pairwise

import numpy as np
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

from compass_ros.rivals.accelerations import SLOW
from compass_ros.rivals.calibrated import Calibrated, Shots
from compass_ros.types import Floats

MOST_POINTS = 250
"""Neighbouring frames are averaged down to this number of points a body; the cost grows with its cube."""
_SIZE = np.array([0.45, 0.225, 0.5, 0.5, 1.0])
"""Half the table [m], speed [m/s], time [s]: one for each input."""


def gaussian_process(given: Calibrated) -> Floats:
    """(E, F, C) the held-out episodes as the simulator with the learned correction predicts them [m]."""
    corrected = given.held_out.predicted.copy()
    learned, asked = _inputs(given.fit), _inputs(given.held_out)
    for n in range(len(given.movers)):
        own = slice(2 * n, 2 * n + 2)
        points, targets = _averaged(learned[:, :, n], given.fit.residual[:, :, own])
        kernel = ConstantKernel(1.0, (1e-3, 1e3)) * RBF(np.ones(5), (0.03, 30.0)) + WhiteKernel(0.3, (1e-4, 1e2))
        process = GaussianProcessRegressor(kernel, normalize_y=True, random_state=0)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ConvergenceWarning)  # a length at its bound: the input does not matter
            process.fit(points, targets)
        shape = asked[:, :, n].shape
        corrected[:, :, own] += process.predict(asked[:, :, n].reshape(-1, 5)).reshape(*shape[:2], 2)
    return corrected


def _inputs(shots: Shots) -> Floats:
    """(E, F, N, 5) simulated place, velocity, and time since the body first moved, in units of `_SIZE`."""
    moving = np.linalg.norm(shots.paths[..., 2:], axis=-1) > SLOW
    time = shots.data.time_s[:, :, None]
    struck = np.min(np.where(moving, time, np.inf), axis=1, keepdims=True)
    since = np.where(np.isfinite(struck), np.maximum(time - struck, 0.0), 0.0)
    return np.asarray(np.concatenate([shots.paths, since[..., None]], axis=-1) / _SIZE)


def _averaged(inputs: Floats, residual: Floats) -> tuple[Floats, Floats]:
    """(n, 5), (n, 2) means over neighbouring frames of one episode, of those that were seen."""
    episodes, frames = inputs.shape[:2]
    blocks = max(MOST_POINTS // episodes, 1)
    edges = np.linspace(0, frames, min(blocks, frames) + 1).astype(int)
    points, targets = [], []
    for e in range(episodes):
        for start, end in pairwise(edges):
            seen = ~np.isnan(residual[e, start:end, 0])
            if seen.any():
                points.append(inputs[e, start:end][seen].mean(axis=0))
                targets.append(residual[e, start:end][seen].mean(axis=0))
    return np.array(points), np.array(targets)

"""What the rivals for missing physics are given: the calibrated simulator and what it leaves of the recordings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from compass_ros.calibration.causal_map import causal_map_refined
from compass_ros.calibration.noise import Noise
from compass_ros.calibration.problem import Problem
from compass_ros.cells import Cell
from compass_ros.config import CalibrationConfig
from compass_ros.errors import DataError
from compass_ros.posing import noise_of, pose
from compass_ros.selection import split
from compass_ros.simulation import Simulator
from compass_ros.simulation.replay import Recordings, recordings
from compass_ros.types import Episode, Floats, Report, silent


@dataclass(frozen=True)
class Shots:
    """Recordings beside what a simulator says. E episodes, F frames, N bodies, C = 2 N columns."""

    data: Recordings
    predicted: Floats
    """(E, F, C) [m]"""
    paths: Floats
    """(E, F, N, 4) simulated x, y [m], vx, vy [m/s] in the world."""

    @property
    def places(self) -> Floats:
        """(E, F, N, 2) measured positions in the world [m]: without what the camera adds; NaN where not seen."""
        moved = self.data.measured - self.predicted
        return np.asarray(moved.reshape(self.paths[..., :2].shape) + self.paths[..., :2])

    @property
    def residual(self) -> Floats:
        """(E, F, C) measured less predicted [m]; NaN where not seen."""
        return np.asarray(self.data.measured - self.predicted)


@dataclass(frozen=True)
class Calibrated:
    """A simulator at its best parameters, and the recordings that it was and was not fitted to."""

    simulator: Simulator
    values: Floats
    """(P,)"""
    spread: Floats
    """(P, n) a square root of the covariance of the values: values + spread @ z, z standard normal, are as likely."""
    movers: tuple[str, ...]
    fit: Shots
    held_out: Shots
    noise: Noise

    def predict(self, simulator: Simulator, values: Floats, data: Recordings) -> Floats:
        """(E, F, C) by another simulator or other values."""
        return simulator.observe(np.tile(values, (len(data.inputs), 1)), data.inputs, data.time_s)


def problems(
    episodes: Sequence[Episode], cell: Cell, config: CalibrationConfig
) -> tuple[Simulator, Problem, Recordings, Recordings, Noise]:
    """Recordings to fit, as a problem, and held-out ones. Raises DataError where none can be held out."""
    fit, held_out = split(episodes, config)
    if not held_out:
        raise DataError(f"{len(episodes)} episodes and a held-out share of {config.held_out_share:g}: none is held out")
    simulator = Simulator(cell, threads=config.threads)
    data, judge = recordings(cell, fit), recordings(cell, held_out)
    noise = noise_of(cell, data)
    return simulator, pose(simulator, data, noise), data, judge, noise


def calibrate_plain(simulator: Simulator, problem: Problem, data: Recordings, judge: Recordings, noise: Noise,
                    report: Report = silent) -> Calibrated:  # fmt: skip
    """Our own calibration of the parameters, without looking for missing physics."""
    estimate, refined = causal_map_refined(problem, report)
    free = refined.fit.free
    spread = np.zeros((len(estimate.values), len(free)))
    root = np.linalg.cholesky(refined.covariance[: len(free), : len(free)])
    spread[free] = root * problem.likelihood.prior_std[free][:, None]
    return beside(simulator, estimate.values, spread, data, judge, noise)


def beside(
    simulator: Simulator, values: Floats, spread: Floats, data: Recordings, judge: Recordings, noise: Noise
) -> Calibrated:
    """A simulator at given values beside the recordings. Raises DataError unless all that is tracked slides flat."""
    cell = simulator.cell
    movers = simulator.movers()
    if [o.body or o.name for o in cell.objects] != list(movers) or any(o.quantity != "xy" for o in cell.objects):
        raise DataError(f"{cell.name}: these rivals need bodies that slide in the plane, tracked as xy")
    fit, held_out = (_shots(simulator, values, movers, d) for d in (data, judge))
    return Calibrated(simulator, values, spread, movers, fit, held_out, noise)


def rms(predicted: Floats, measured: Floats) -> float:
    """Root mean square distance of (..., 2 N) columns [m], as the gap of a result has it."""
    squared = (predicted - measured) ** 2
    distance2 = squared.reshape(*squared.shape[:-1], -1, 2).sum(axis=-1)
    return float(np.sqrt(np.nanmean(distance2)))


def _shots(simulator: Simulator, values: Floats, movers: tuple[str, ...], data: Recordings) -> Shots:
    tiled = np.tile(values, (len(data.inputs), 1))
    predicted = simulator.observe(tiled, data.inputs, data.time_s)
    return Shots(data, predicted, simulator.paths(tiled, data.inputs, data.time_s, movers))

"""What every calibration method is given: recordings, a simulator as functions, and how much it may spend."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from compass_ros.calibration.likelihood import Likelihood
from compass_ros.types import Differences, Floats, Ints, Parameter

Trajectories = Callable[[Floats, Ints], Floats]
"""(B, P) parameter values, (B,) indices of episodes -> (B, F, C) tracked channels at the recorded stamps."""


@dataclass(frozen=True)
class Problem:
    """E recorded episodes of F frames (padded) and C tracked channels, and P parameters to find."""

    differences: Differences
    trajectories: Trajectories
    measured: Floats
    """(E, F, C) in the units of the channels; any finite number where `weight` is 0."""
    weight: Floats
    """(E, F, C) one over the standard deviation of the noise; 0 where nothing was seen."""
    actions: Floats
    """(E, A) the shot commands."""
    parameters: tuple[Parameter, ...]
    factors: tuple[str, ...]
    start: Floats
    """(P,) first guess."""
    simulated_seconds: float
    """Length of one rollout."""
    apart: Callable[[Floats, Floats], Floats]
    """(..., C) observations, the same -> (..., K) how far apart by factor [m or rad]."""
    distance: Callable[[Floats], float]
    """(P,) -> rms distance from the recordings as it is reported [m or rad]; what was asked once is not simulated."""
    likelihood: Likelihood
    """The same recordings with their noise and prior, for methods that look into the episodes."""

    @property
    def episodes(self) -> Ints:
        """(E,) their indices."""
        return np.arange(len(self.actions), dtype=np.int64)

    @property
    def low(self) -> Floats:
        return np.array([p.low for p in self.parameters])

    @property
    def high(self) -> Floats:
        return np.array([p.high for p in self.parameters])

    @property
    def half_width(self) -> Floats:
        return np.array([p.half_width for p in self.parameters])

    def mean_differences(self, values: Floats) -> Floats:
        """(B, P) -> (B, K) trajectory differences averaged over all episodes; costs B x E rollouts."""
        count = len(self.actions)
        d = self.differences(np.repeat(values, count, axis=0), np.tile(self.episodes, len(values)))
        return np.asarray(d.reshape(len(values), count, -1).mean(axis=1))

    def residuals(self, values: Floats) -> Floats:
        """(B, P) -> (B, E F C) weighted residuals (predicted - measured) / sigma; costs B x E rollouts."""
        count = len(self.actions)
        predicted = self.trajectories(np.repeat(values, count, axis=0), np.tile(self.episodes, len(values)))
        predicted = predicted.reshape(len(values), *self.measured.shape)
        error = np.where(self.weight > 0, predicted - self.measured, 0.0) * self.weight
        return np.asarray(error.reshape(len(values), -1))


@dataclass(frozen=True)
class Allowance:
    """What a method may spend: the paper's 10 iterations of 10 real and 10 x 64 simulated rollouts by default."""

    iterations: int = 10
    real: int = 10
    """N: recorded episodes used in an iteration."""
    sim: int = 64
    """M: simulated rollouts for each of them."""

    @property
    def per_iteration(self) -> int:
        return self.real * self.sim

    @property
    def rollouts(self) -> int:
        return self.iterations * self.per_iteration

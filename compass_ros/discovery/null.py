"""How much a candidate would seem to explain where nothing is missing: the screen on simulated noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from compass_ros.calibration.noise import Noise, correlated
from compass_ros.discovery.screen import Score, Space
from compass_ros.types import Floats

DRAWS = 300


@dataclass(frozen=True)
class Null:
    """Largest gain of any candidate in each simulated recording of the fitted model without effects."""

    gains: Floats
    """(DRAWS,)"""

    def false_alarm_p(self, gain: float) -> float:
        """Probability of such a gain, or a larger one, where nothing is missing."""
        return float((1 + np.sum(self.gains >= gain)) / (1 + len(self.gains)))

    @property
    def largest(self) -> float:
        return float(self.gains.max())


def simulate_null(space: Space, scores: Sequence[Score], noise: Noise, seed: int) -> Null:
    """Noise of the recordings' own correlation through the first-order screen, at the shapes that the screen chose.

    The screen chose the shapes to please the real residual; a search over k free shapes gains about k / 2 more than a
    fixed one (Wilks 1938), which each draw is given on top.
    """
    rng = np.random.default_rng(seed)
    tangents = np.stack([s.tangent for s in scores if np.any(s.tangent)], axis=1) if scores else np.zeros((1, 0))
    free = np.array([sum(1 for q in s.candidate.attached.effect.quantities) for s in scores if np.any(s.tangent)])
    left = space.off_parameters(tangents)
    length = np.sqrt(np.sum(left**2, axis=0))
    keep = length > 1e-6
    unit = left[:, keep] / length[keep]
    episodes, frames, columns = space.likelihood.measured.shape
    measured = ~np.isnan(space.likelihood.measured)
    gains = np.zeros(DRAWS)
    for i in range(DRAWS):
        white = rng.standard_normal((episodes, frames, columns))
        draw = correlated(white, noise.correlation)
        pull = unit.T @ (np.where(measured, draw, 0.0).reshape(episodes, -1) * space.weight).ravel()
        extra = rng.chisquare(np.maximum(free[keep] - 1, 0) + 1e-9)
        gains[i] = float(np.max(0.5 * (pull**2 / noise.correlation_time + extra), initial=0.0))
    return Null(gains)

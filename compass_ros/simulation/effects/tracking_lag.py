"""A tracker that smooths over the past.

observed = mean of the true positions of the past, weighted by a gamma density of their age: mean `time`, standard
deviation `spread` times that. 1 is a first-order low-pass, 0.58 as wide as a moving average, small a mere latency.
Source: impulse response of equal first-order filters in a row; generalised Gauss-Laguerre nodes, exact for polynomials
up to degree 11.
"""

from __future__ import annotations

import numpy as np
from scipy.special import roots_genlaguerre

from compass_ros.simulation.effects.effect import Context, Effect, Quantity, Sample
from compass_ros.types import Floats

_NODES = 6


def _sensing(sample: Sample, numbers: Floats, context: Context) -> Sample:
    spreads, which = np.unique(numbers[:, 1], return_inverse=True)
    ages, weights = np.stack([_kernel(spread) for spread in spreads], axis=1)[:, which]  # (B, _NODES) each

    def lagged(time: Floats) -> Floats:
        now = sample(time)
        behind = [
            weights[:, i, None, None] * (sample(time - numbers[:, :1] * ages[:, i, None]) - now) for i in range(_NODES)
        ]
        return np.asarray(now + np.sum(behind, axis=0))

    return lagged


def _kernel(spread: float) -> Floats:
    """(2, _NODES) ages as parts of their mean, and weights that sum to one."""
    order = spread**-2
    nodes, weights = roots_genlaguerre(_NODES, order - 1)
    return np.stack([nodes / order, weights / weights.sum()])


EFFECT = Effect(
    name="tracking_lag",
    channel="sensing",
    quantities=(
        Quantity("time", "s", 0.0, 0.1, 0.004),
        Quantity("spread", "1", 0.25, 1.0, 0.2, amplitude=False, start=0.7),
    ),
    sentence="a lag of the tracker",
    on=("camera",),
    sensing=_sensing,
)

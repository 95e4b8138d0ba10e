"""A tracker that smooths over the past.

observed = first-order low-pass of the true position with the given time, as a quadrature of its exponential kernel.
Source: exponential filter; Gauss-Laguerre nodes, exact for polynomials up to degree 11.
"""

from __future__ import annotations

import numpy as np
from scipy.special import roots_laguerre

from compass_ros.simulation.effects.effect import Context, Effect, Quantity, Sample
from compass_ros.types import Floats

_NODES, _WEIGHTS = roots_laguerre(6)


def _sensing(sample: Sample, numbers: Floats, context: Context) -> Sample:
    def lagged(time: Floats) -> Floats:
        now = sample(time)
        behind = [w * (sample(time - numbers[:, :1] * node) - now) for node, w in zip(_NODES, _WEIGHTS, strict=True)]
        return np.asarray(now + np.sum(behind, axis=0))

    return lagged


EFFECT = Effect(
    name="tracking_lag",
    channel="sensing",
    quantities=(Quantity("time", "s", 0.0, 0.1, 0.004),),
    sentence="a lag of the tracker",
    sensing=_sensing,
    on="cell",
)

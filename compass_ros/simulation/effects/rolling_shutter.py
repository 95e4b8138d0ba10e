"""Rows of the image that are exposed one after another.

observed(t) = true(t + time y / 0.225 m), y the position across the table. Source: row-wise read-out of a CMOS sensor
whose rows lie along the table; 0.225 m is half the width that the image covers.
"""

from __future__ import annotations

import numpy as np

from compass_ros.simulation.effects.effect import Context, Effect, Quantity, Sample
from compass_ros.types import Floats

_HALF_WIDTH = 0.225  # m


def _sensing(sample: Sample, numbers: Floats, context: Context) -> Sample:
    def shuttered(time: Floats) -> Floats:
        seen = sample(time)
        out = seen.copy()
        for x, y in context.planes:
            out[:, :, [x, y]] = sample(time + numbers[:, :1] * seen[:, :, y] / _HALF_WIDTH)[:, :, [x, y]]
        return out

    return shuttered


def _ahead(numbers: Floats, last: float) -> float:
    return 2.0 * float(np.abs(numbers).max())  # positions stay within twice the half width, biases included


EFFECT = Effect(
    name="rolling_shutter",
    channel="sensing",
    quantities=(Quantity("time", "s", -0.05, 0.05, 0.003),),
    sentence="a rolling shutter",
    on=("camera",),
    sensing=_sensing,
    ahead=_ahead,
)

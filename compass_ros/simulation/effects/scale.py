"""A sensor whose scale is wrong.

observed = (1 + scale) true. Source: error of a sensor's sensitivity, of an encoder's counts per turn.
"""

from __future__ import annotations

import numpy as np

from compass_ros.simulation.effects.effect import Context, Effect, Quantity, Sample
from compass_ros.simulation.sizes import MODEST
from compass_ros.types import Floats


def _sensing(sample: Sample, numbers: Floats, context: Context) -> Sample:
    return lambda time: np.asarray(sample(time) * (1 + numbers[:, None, :1]))


EFFECT = Effect(
    name="scale",
    channel="sensing",
    quantities=(Quantity("scale", "1", -0.5, 0.5, MODEST),),
    sentence="an error of the sensor's scale",
    on=("encoder", "sensor"),
    sensing=_sensing,
    by_name=True,
)

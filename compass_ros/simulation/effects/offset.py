"""A sensor whose zero is elsewhere.

observed = true + offset, the same for each number of the signal. Source: zero error of a sensor.
"""

from __future__ import annotations

import numpy as np

from compass_ros.simulation.effects.effect import Context, Effect, Quantity, Sample
from compass_ros.simulation.extents import SignalSize
from compass_ros.simulation.sizes import LARGEST, MODEST
from compass_ros.types import Floats


def _sensing(sample: Sample, numbers: Floats, context: Context) -> Sample:
    return lambda time: np.asarray(sample(time) + numbers[:, None, :1])


def _on_signal(size: SignalSize) -> tuple[Quantity, ...]:
    most = LARGEST * size.spread
    return (Quantity("offset", size.unit, -most, most, MODEST * size.spread),)


EFFECT = Effect(
    name="offset",
    channel="sensing",
    quantities=_on_signal(SignalSize("encoder", "rad", 1.0)),
    sentence="an error of the sensor's zero",
    on=("encoder", "sensor"),
    sensing=_sensing,
    on_signal=_on_signal,
    by_name=True,
    tuned_as="observed_offset",
)

"""Stamps that are later than the moment that the image shows.

observed(t) = true(t - latency). Source: exposure and transfer before stamping.
"""

from __future__ import annotations

from compass_ros.simulation.effects.effect import Context, Effect, Quantity, Sample
from compass_ros.types import Floats


def _sensing(sample: Sample, numbers: Floats, context: Context) -> Sample:
    return lambda time: sample(time - numbers[:, :1])


EFFECT = Effect(
    name="camera_latency",
    channel="sensing",
    quantities=(Quantity("latency", "s", 0.0, 0.2, 0.005),),
    sentence="a latency of the camera",
    on=("camera",),
    sensing=_sensing,
)

"""An image scale that is wrong.

observed = (1 + scale) true, about the origin of the table. Source: error of focal length or camera height.
"""

from __future__ import annotations

from compass_ros.simulation.effects.effect import Context, Effect, Quantity, Sample
from compass_ros.types import Floats


def _sensing(sample: Sample, numbers: Floats, context: Context) -> Sample:
    def scaled(time: Floats) -> Floats:
        seen = sample(time).copy()
        seen[:, :, list(context.positions)] *= 1 + numbers[:, None, :1]
        return seen

    return scaled


EFFECT = Effect(
    name="camera_scale",
    channel="sensing",
    quantities=(Quantity("scale", "1", -0.1, 0.1, 0.003),),
    sentence="an error of the camera's scale",
    on=("camera",),
    sensing=_sensing,
)

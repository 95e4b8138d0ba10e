"""A camera that is turned about its axis.

observed = rotation by `angle` of the true position, about the origin. Source: error of the extrinsic calibration.
"""

from __future__ import annotations

import numpy as np

from compass_ros.simulation.effects.effect import Context, Effect, Quantity, Sample
from compass_ros.types import Floats


def _sensing(sample: Sample, numbers: Floats, context: Context) -> Sample:
    def rotated(time: Floats) -> Floats:
        seen = sample(time)
        out = seen.copy()
        cos, sin = np.cos(numbers[:, :1]), np.sin(numbers[:, :1])
        for x, y in context.planes:
            out[:, :, x] = cos * seen[:, :, x] - sin * seen[:, :, y]
            out[:, :, y] = sin * seen[:, :, x] + cos * seen[:, :, y]
        return out

    return rotated


EFFECT = Effect(
    name="camera_rotation",
    channel="sensing",
    quantities=(Quantity("angle", "rad", -0.1, 0.1, 0.003),),
    sentence="a rotation of the camera",
    on=("camera",),
    sensing=_sensing,
)

"""Straight lines that the image bends.

observed = true (1 + k1 r^2), r from the origin. Source: first radial term of the Brown-Conrady model, on the plane.
"""

from __future__ import annotations

from compass_ros.simulation.effects.effect import Context, Effect, Quantity, Sample
from compass_ros.types import Floats


def _sensing(sample: Sample, numbers: Floats, context: Context) -> Sample:
    def distorted(time: Floats) -> Floats:
        seen = sample(time)
        out = seen.copy()
        for x, y in context.planes:
            r2 = seen[:, :, x] ** 2 + seen[:, :, y] ** 2
            out[:, :, [x, y]] = seen[:, :, [x, y]] * (1 + numbers[:, :1] * r2)[:, :, None]
        return out

    return distorted


EFFECT = Effect(
    name="lens_distortion",
    channel="sensing",
    quantities=(Quantity("k1", "1/m^2", -0.4, 0.4, 0.02),),
    sentence="a distortion of the lens",
    on=("camera",),
    sensing=_sensing,
)

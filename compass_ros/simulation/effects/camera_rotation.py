"""A camera that is turned about its axis.

observed = rotation by `angle` about z through (centre_x, centre_y) of the true position, and of the orientation of what
has one. Source: error of the extrinsic calibration; about another axis it is `rotation`.
"""

from __future__ import annotations

import numpy as np

from compass_ros.simulation.effects.cameras import SEEN, away, centre, filled
from compass_ros.simulation.effects.effect import Context, Effect, Quantity, Sample
from compass_ros.simulation.effects.rotation import product
from compass_ros.simulation.extents import SignalSize
from compass_ros.types import Floats


def _sensing(sample: Sample, numbers: Floats, context: Context) -> Sample:
    angle, middle = np.split(filled(numbers, 3), [1], axis=1)
    cos, sin = np.cos(angle), np.sin(angle)
    turn = np.stack([0 * angle, 0 * angle, np.sin(angle / 2), np.cos(angle / 2)], axis=2)  # (B, 1, 4), the scalar last

    def rotated(time: Floats) -> Floats:
        seen = sample(time)
        out = seen.copy()
        for columns, turned in zip(context.places, context.turns, strict=True):
            x, y = np.moveaxis(away(seen, columns[:2], middle), 2, 0)
            out[:, :, columns[0]] += (cos - 1) * x - sin * y
            out[:, :, columns[1]] += sin * x + (cos - 1) * y
            if turned:
                out[:, :, turned] = product(turn, seen[:, :, turned])
        return out

    return rotated


def _on_signal(size: SignalSize) -> tuple[Quantity, ...]:
    return (Quantity("angle", "rad", -0.1, 0.1, 0.003), *centre(size, "xy"))


EFFECT = Effect(
    name="camera_rotation",
    channel="sensing",
    quantities=_on_signal(SEEN),
    sentence="a rotation of the camera",
    on=("camera",),
    sensing=_sensing,
    on_signal=_on_signal,
)

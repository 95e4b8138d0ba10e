"""An image scale that is wrong.

observed = true + scale r, r from (centre_x, centre_y, centre_z), a point of the optical axis, to the body.
Source: error of focal length or of the camera's distance.
"""

from __future__ import annotations

import numpy as np

from compass_ros.simulation.effects.cameras import SEEN, away, centre, filled
from compass_ros.simulation.effects.effect import Context, Effect, Quantity, Sample
from compass_ros.simulation.extents import SignalSize
from compass_ros.types import Floats


def _sensing(sample: Sample, numbers: Floats, context: Context) -> Sample:
    scale, middle = np.split(filled(numbers, 4), [1], axis=1)

    def scaled(time: Floats) -> Floats:
        seen = sample(time)
        out = seen.copy()
        for columns in context.places:
            out[:, :, columns] += scale[:, None] * away(seen, columns, middle)
        return out

    return scaled


def _on_signal(size: SignalSize) -> tuple[Quantity, ...]:
    return (Quantity("scale", "1", -0.1, 0.1, 0.003), *centre(size, "xyz"))


EFFECT = Effect(
    name="camera_scale",
    channel="sensing",
    quantities=_on_signal(SEEN),
    sentence="an error of the camera's scale",
    on=("camera",),
    sensing=_sensing,
    on_signal=_on_signal,
)

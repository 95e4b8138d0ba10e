"""Straight lines that the image bends.

observed = true + k1 |r|^2 r, r from the optical axis to the body, at a right angle to the axis. The axis goes through
(centre_x, centre_y, centre_z), along z turned by the vector (tilt_x, tilt_y, 0); in the plane of x and y along z.
Source: first radial term of the Brown-Conrady model, k1 over the square of the camera's distance.
"""

from __future__ import annotations

import numpy as np

from compass_ros.simulation.effects.cameras import SEEN, along, away, centre, filled, tilt
from compass_ros.simulation.effects.effect import Context, Effect, Quantity, Sample
from compass_ros.simulation.extents import SignalSize
from compass_ros.types import Floats

_LARGEST, _MODEST = 0.1, 0.005
"""Share by which what is at the edge of what was seen, with the axis in its middle, can be displaced."""


def _sensing(sample: Sample, numbers: Floats, context: Context) -> Sample:
    k1, middle, tilts = np.split(filled(numbers, 6), [1, 4], axis=1)
    axis = along(tilts)[:, None]

    def distorted(time: Floats) -> Floats:
        seen = sample(time)
        out = seen.copy()
        for columns in context.places:
            own = axis[..., : len(columns)]
            r = away(seen, columns, middle)
            r = r - np.sum(r * own, axis=2, keepdims=True) * own if len(columns) > 2 else r
            out[:, :, columns] += k1[:, None] * np.sum(r**2, axis=2, keepdims=True) * r
        return out

    return distorted


def _on_signal(size: SignalSize) -> tuple[Quantity, ...]:
    edge = size.reach**-2
    k1 = Quantity("k1", "1/m^2", -_LARGEST * edge, _LARGEST * edge, _MODEST * edge)
    return (k1, *centre(size, "xyz", searched=True), *(tilt() if len(size.middle) > 2 else ()))


EFFECT = Effect(
    name="lens_distortion",
    channel="sensing",
    quantities=_on_signal(SEEN),
    sentence="a distortion of the lens",
    on=("camera",),
    sensing=_sensing,
    on_signal=_on_signal,
)

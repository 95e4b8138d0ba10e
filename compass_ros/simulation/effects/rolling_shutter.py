"""Rows of the image that are exposed one after another.

observed(t) = true(t + (x, y, z) . r), r from row zero, which goes through (centre_x, centre_y, centre_z), to the body;
the vector (x, y, z) points along the read-out, and is the time that a metre takes. No row is read more than 0.1 s from
row zero, the whole time between two frames of a slow camera.
Source: row-wise read-out of a CMOS sensor (Geyer, Meingast and Sastry 2005), the row that of where the body is at t.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from compass_ros.simulation.effects.cameras import SEEN, away, centre, filled
from compass_ros.simulation.effects.effect import Context, Effect, Quantity, Sample
from compass_ros.simulation.extents import SignalSize
from compass_ros.types import Floats

_LONGEST = 0.1
"""Of a read-out [s]."""
_MODEST = 0.005
"""Time from the middle to the edge of what was seen [s]."""
_ONCE = 0.225
"""Files of old say it as a time over half the width of one table [m], with row zero in its middle."""


def _sensing(sample: Sample, numbers: Floats, context: Context) -> Sample:
    given = filled(numbers, 6)
    per_metre, row_zero = given[:, [0, 1, 4]], given[:, [2, 3, 5]]

    def shuttered(time: Floats) -> Floats:
        seen = sample(time)
        out = seen.copy()
        for columns, turned in zip(context.places, context.turns, strict=True):
            r = away(seen, columns, row_zero)
            late = np.clip(np.sum(per_metre[:, None, : len(columns)] * r, axis=2), -_LONGEST, _LONGEST)
            own = [*columns, *turned]
            out[:, :, own] = sample(time + late)[:, :, own]
        return out

    return shuttered


def _ahead(numbers: Floats, last: float) -> float:
    return _LONGEST if numbers[:, _amplitudes(numbers.shape[1])].any() else 0.0


def _amplitudes(count: int) -> list[int]:
    """Places of the times per metre among so many numbers."""
    return [0, 1, 4][: 3 if count > 4 else 2]


def _on_signal(size: SignalSize) -> tuple[Quantity, ...]:
    """Those along z last, so that in the plane they are missing."""
    most, modest = 2 * _LONGEST / size.reach, _MODEST / size.reach
    x, y, z = (Quantity(axis, "s/m", -most, most, modest, later=axis != "y") for axis in "xyz")
    y = replace(y, formerly=("time", "s", 1 / _ONCE))
    return (x, y, *centre(size, "xy"), *((z, *centre(size, "z")) if len(size.middle) > 2 else ()))


EFFECT = Effect(
    name="rolling_shutter",
    channel="sensing",
    quantities=_on_signal(SEEN),
    sentence="a rolling shutter",
    on=("camera",),
    sensing=_sensing,
    ahead=_ahead,
    on_signal=_on_signal,
)

"""An arm that cannot go as fast as it is told.

|u| -> |u| / (1 + (|u| inverse_limit)^sharpness)^(1/sharpness), so that zero is absent.
Source: smooth saturation; of sharpness 8 it is within 9 % of min(|u|, 1 / inverse_limit) everywhere, of 30 within 3 %.
"""

from __future__ import annotations

import numpy as np

from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.types import Floats


def _controls(controls: Floats, numbers: Floats, context: Context) -> Floats:
    speed, sharpness = np.linalg.norm(controls, axis=2), numbers[:, 1:]
    ratio = speed * numbers[:, :1]
    return np.asarray(controls / ((1 + ratio**sharpness) ** (1 / sharpness))[:, :, None])


EFFECT = Effect(
    name="velocity_saturation",
    channel="actuation",
    quantities=(
        Quantity("inverse_limit", "s/m", 0.0, 10.0, 0.3),
        Quantity("sharpness", "1", 2.0, 60.0, 4.0, amplitude=False, start=8.0),
    ),
    sentence="a limit of the arm's speed",
    controls=_controls,
    on="cell",
)

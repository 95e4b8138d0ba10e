"""An arm that cannot go as fast as it is told.

|u| -> |u| / (1 + (|u| inverse_limit)^8)^(1/8), so that zero is absent.
Source: smooth saturation, within 9 % of min(|u|, 1 / inverse_limit) everywhere.
"""

from __future__ import annotations

import numpy as np

from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.types import Floats


def _controls(controls: Floats, numbers: Floats, context: Context) -> Floats:
    speed = np.linalg.norm(controls, axis=2)
    return np.asarray(controls / ((1 + (speed * numbers[:, :1]) ** 8) ** 0.125)[:, :, None])


EFFECT = Effect(
    name="velocity_saturation",
    channel="actuation",
    quantities=(Quantity("inverse_limit", "s/m", 0.0, 10.0, 0.3),),
    sentence="a limit of the arm's speed",
    controls=_controls,
    on="cell",
)

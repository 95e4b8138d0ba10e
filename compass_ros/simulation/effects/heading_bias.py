"""An arm that pushes beside the commanded direction.

u is turned by `angle` about z, anticlockwise. Source: misaligned tool or base frame.
"""

from __future__ import annotations

import numpy as np

from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.types import Floats


def _controls(controls: Floats, numbers: Floats, context: Context) -> Floats:
    cos, sin = np.cos(numbers[:, :1]), np.sin(numbers[:, :1])
    x, y = controls[:, :, 0], controls[:, :, 1]
    return np.concatenate([np.stack([cos * x - sin * y, sin * x + cos * y], axis=2), controls[:, :, 2:]], axis=2)


EFFECT = Effect(
    name="heading_bias",
    channel="actuation",
    quantities=(Quantity("angle", "rad", -0.2, 0.2, 0.005),),
    sentence="a bias of the pushing direction",
    on=("tool_drive",),
    controls=_controls,
)

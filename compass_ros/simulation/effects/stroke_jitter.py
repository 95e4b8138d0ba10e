"""Pushes that vary in speed from one episode to the next.

u -> u (1 + deviation). What a rollout is given is the deviation of its own episode; the effect's size, which a fit
finds, is the standard deviation over episodes. Source: random effect on the launch.
"""

from __future__ import annotations

import numpy as np

from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.simulation.site_kinds import SPEED_DRIVES
from compass_ros.types import Floats


def _controls(controls: Floats, numbers: Floats, context: Context) -> Floats:
    return np.asarray(controls * (1 + numbers[:, None, :1]))


EFFECT = Effect(
    name="stroke_jitter",
    channel="actuation",
    quantities=(Quantity("deviation", "1", -0.3, 0.3, 0.01, chance=True),),
    sentence="a scatter of the pushing speed",
    on=(*SPEED_DRIVES, "effort_drive"),
    controls=_controls,
)

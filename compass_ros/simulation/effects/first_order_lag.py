"""An arm that follows its command with a lag.

time u' = command - u, integrated exactly for a command that is constant over a step; before the first command u = 0,
or the position where a position servo stood. Source: first-order servo.
"""

from __future__ import annotations

import numpy as np

from compass_ros.simulation.effects.effect import Context, Effect, Quantity, told_before
from compass_ros.simulation.site_kinds import DRIVES
from compass_ros.types import Floats


def _controls(controls: Floats, numbers: Floats, context: Context) -> Floats:
    keep = np.where(numbers[:, :1] > 0, np.exp(-context.time_step / np.maximum(numbers[:, :1], 1e-9)), 0.0)
    followed = np.empty_like(controls)
    state = told_before(controls, context)
    for step in range(controls.shape[1]):
        state = keep * state + (1 - keep) * controls[:, step]
        followed[:, step] = state
    return followed


EFFECT = Effect(
    name="first_order_lag",
    channel="actuation",
    quantities=(Quantity("time", "s", 0.0, 0.3, 0.005),),
    sentence="a lag of the arm behind its command",
    on=DRIVES,
    controls=_controls,
)

"""A drive that follows its command no faster than at a certain rate.

|u'| <= 1 / inverse_rate for what the drive makes of its command, so that zero is absent; before the first command
u = 0, or the position where a position servo stood. Source: slew-rate limit (Astrom and Murray 2008, ch. 2).
"""

from __future__ import annotations

import numpy as np

from compass_ros.simulation.effects.effect import Context, Effect, Quantity, told_before
from compass_ros.simulation.site_kinds import SINGLE_DRIVES
from compass_ros.simulation.sizes import DriveSize
from compass_ros.types import Floats


def _controls(controls: Floats, numbers: Floats, context: Context) -> Floats:
    limited = numbers[:, :1] > 0
    most = np.where(limited, context.time_step / np.where(limited, numbers[:, :1], 1.0), np.inf)
    followed, state = np.empty_like(controls), told_before(controls, context)
    for step in range(controls.shape[1]):
        ahead = controls[:, step] - state
        state = np.where(np.abs(ahead) <= most, controls[:, step], state + np.clip(ahead, -most, most))
        followed[:, step] = state
    return followed


def _on_drive(size: DriveSize) -> tuple[Quantity, ...]:
    """The time that the largest command takes: up to half an episode."""
    unit = {"rad/s": "s^2/rad", "m/s": "s^2/m"}.get(size.unit, "s")
    each = size.seconds / size.command
    return (Quantity("inverse_rate", unit, 0.0, 0.5 * each, 0.01 * each),)


EFFECT = Effect(
    name="rate_limit",
    channel="actuation",
    quantities=_on_drive(DriveSize("position_drive", 1.0, "1")),
    sentence="a limit of how fast the drive follows its command",
    on=SINGLE_DRIVES,
    controls=_controls,
    on_drive=_on_drive,
)

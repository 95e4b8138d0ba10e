"""A drive that follows its command no faster than at a certain rate, and speeds up and slows down no faster.

|u'| <= 1 / inverse_rate and |u''| <= 1 / inverse_acceleration for what the drive makes of its command, so that zero is
absent; it goes to each command in the least time and stands there: towards one that is e away at the rate at which it
can still stop, sqrt(2 e / inverse_acceleration). Before the first command u = 0, or the position where a position servo
stood. Source: slew-rate limit (Astrom and Murray 2008, ch. 2); trapezoidal profile (Siciliano et al. 2009, section
4.2.1), which hobby servos and motion controllers work out of every command anew.
"""

from __future__ import annotations

import numpy as np

from compass_ros.simulation.effects.effect import Context, Effect, Quantity, told_before
from compass_ros.simulation.native.program import profile
from compass_ros.simulation.site_kinds import SINGLE_DRIVES
from compass_ros.simulation.sizes import DriveSize
from compass_ros.types import Floats


def _controls(controls: Floats, numbers: Floats, context: Context) -> Floats:
    told = told_before(controls, context)
    return np.stack([profile(controls[:, :, 0], numbers, told[:, 0], context.time_step)], axis=2)


def _on_drive(size: DriveSize) -> tuple[Quantity, ...]:
    """By the time that the largest command takes, up to half an episode: at a rate, and from rest to rest, which is
    2 sqrt(command / acceleration)."""
    per = {"rad/s": "/rad", "m/s": "/m"}.get(size.unit, "")
    rate, acceleration = ("s^2", "s^3") if per else ("s", "s^2")
    each, most = size.seconds / size.command, 0.25 * (0.5 * size.seconds) ** 2 / size.command
    return (
        Quantity("inverse_rate", f"{rate}{per}", 0.0, 0.5 * each, 0.01 * each),
        Quantity("inverse_acceleration", f"{acceleration}{per}", 0.0, most, 0.01 * most, later=True),
    )


EFFECT = Effect(
    name="rate_limit",
    channel="actuation",
    quantities=_on_drive(DriveSize("position_drive", 1.0, "1")),
    sentence="a limit of how fast the drive follows its command",
    on=SINGLE_DRIVES,
    controls=_controls,
    on_drive=_on_drive,
)

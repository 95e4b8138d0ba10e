"""A drive that follows its command with play.

What the drive makes of its command stays while the command moves within `width`, and is dragged along by its ends:
u(t) = min(max(u(t - dt), command - width / 2), command + width / 2); before the first command u = 0, or the position
where a position servo stood. Source: the play operator (Krasnosel'skii and Pokrovskii 1989).
"""

from __future__ import annotations

import numpy as np

from compass_ros.simulation.effects.effect import Context, Effect, Quantity, told_before
from compass_ros.simulation.site_kinds import SINGLE_DRIVES
from compass_ros.simulation.sizes import DriveSize
from compass_ros.types import Floats


def _controls(controls: Floats, numbers: Floats, context: Context) -> Floats:
    half = 0.5 * numbers[:, :1]
    followed, state = np.empty_like(controls), told_before(controls, context)
    for step in range(controls.shape[1]):
        state = np.clip(state, controls[:, step] - half, controls[:, step] + half)
        followed[:, step] = state
    return followed


def _on_drive(size: DriveSize) -> tuple[Quantity, ...]:
    return (Quantity("width", size.unit, 0.0, 0.5 * size.command, 0.01 * size.command),)


EFFECT = Effect(
    name="hysteresis",
    channel="actuation",
    quantities=_on_drive(DriveSize("position_drive", 1.0, "1")),
    sentence="play between the command and the drive",
    on=SINGLE_DRIVES,
    controls=_controls,
    on_drive=_on_drive,
)

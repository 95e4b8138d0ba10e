"""An arm that cannot go as fast as it is told.

|u| -> |u| / (1 + (|u| inverse_limit)^sharpness)^(1/sharpness), so that zero is absent.
Source: smooth saturation; of sharpness 8 it is within 9 % of min(|u|, 1 / inverse_limit) everywhere, of 30 within 3 %.
"""

from __future__ import annotations

import numpy as np

from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.simulation.site_kinds import SPEED_DRIVES
from compass_ros.simulation.sizes import DriveSize
from compass_ros.types import Floats


def _controls(controls: Floats, numbers: Floats, context: Context) -> Floats:
    speed, sharpness = np.linalg.norm(controls, axis=2), numbers[:, 1:]
    ratio = speed * numbers[:, :1]
    return np.asarray(controls / ((1 + ratio**sharpness) ** (1 / sharpness))[:, :, None])


def _on_drive(size: DriveSize) -> tuple[Quantity, ...]:
    """The shares of the largest command that are asked of a tool pushed at 0.5 m/s."""
    per = size.unit.split("/")[0]
    return (
        Quantity("inverse_limit", f"s/{per}" if per != "1" else "1", 0.0, 5.0 / size.command, 0.15 / size.command),
        Quantity("sharpness", "1", 2.0, 60.0, 4.0, amplitude=False, start=8.0),
    )


EFFECT = Effect(
    name="velocity_saturation",
    channel="actuation",
    quantities=(
        Quantity("inverse_limit", "s/m", 0.0, 10.0, 0.3),
        Quantity("sharpness", "1", 2.0, 60.0, 4.0, amplitude=False, start=8.0),
    ),
    sentence="a limit of the arm's speed",
    on=SPEED_DRIVES,
    controls=_controls,
    on_drive=_on_drive,
)

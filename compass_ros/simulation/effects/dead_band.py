"""An arm that loses a fixed speed on the way.

|u| -> max(|u| - band, 0). Source: dead band of a drive with dry friction.
"""

from __future__ import annotations

import numpy as np

from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.simulation.sites import SPEED_DRIVES
from compass_ros.simulation.sizes import DriveSize
from compass_ros.types import Floats


def _controls(controls: Floats, numbers: Floats, context: Context) -> Floats:
    speed = np.linalg.norm(controls, axis=2, keepdims=True)
    return np.asarray(controls * np.maximum(1 - numbers[:, None, :1] / np.maximum(speed, 1e-12), 0))


def _on_drive(size: DriveSize) -> tuple[Quantity, ...]:
    """The shares of the largest command that are asked of a tool pushed at 0.5 m/s."""
    return (Quantity("band", size.unit, 0.0, 0.3 * size.command, 0.01 * size.command),)


EFFECT = Effect(
    name="dead_band",
    channel="actuation",
    quantities=(Quantity("band", "m/s", 0.0, 0.15, 0.005),),
    sentence="a dead band of the arm",
    on=(*SPEED_DRIVES, "effort_drive"),
    controls=_controls,
    on_drive=_on_drive,
)

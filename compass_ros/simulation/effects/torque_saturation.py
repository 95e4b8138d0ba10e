"""A drive that cannot push as hard as its model.

|f| <= 1 / inverse_limit for the force f of an actuator (before its gear), so that zero is absent; along its motion v no
more than (1 - |v| inverse_speed) / inverse_limit, which is nothing at the speed that the drive has without a load. A
limit that the scene has stays where it is tighter.
Source: limit of a motor's current, MuJoCo's `forcerange`; line of torque and speed of a motor on a constant voltage
(Fitzgerald, Kingsley and Umans 2003, Electric Machinery, chapter 7).
"""

from __future__ import annotations

import mujoco
import numpy as np

from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.simulation.site_kinds import SINGLE_DRIVES
from compass_ros.simulation.sizes import DriveSize
from compass_ros.types import Floats


def _model(model: mujoco.MjModel, numbers: Floats, context: Context) -> None:
    if numbers[0] <= 0:
        return
    limit = 1 / numbers[0]
    for drive in context.sites:
        for actuator in drive.actuators:
            bounds = model.actuator_forcerange[actuator] if model.actuator_forcelimited[actuator] else (-limit, limit)
            model.actuator_forcerange[actuator] = np.clip(bounds, -limit, limit)
            model.actuator_forcelimited[actuator] = 1


def _forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
    if not numbers[:, 1:].any():
        return ()
    return tuple(Term(Kind.TORQUE_SPEED, drive, numbers) for drive in context.sites)


def _on_drive(size: DriveSize) -> tuple[Quantity, ...]:
    """Nothing happens before the limit is the largest force that was seen: a modest one cuts a tenth of that off. What
    was seen to move twice as fast as its drive does without a load was moved by something else. A search begins with a
    drive that was at most at half of that speed, where a motor has its largest power; a fit that began at no fall, at
    0.3 and at 0.6 over the fastest speed ended at mean squares of 32.1 to 32.4 (`two_joint_arm_driven` 991002)."""
    one, per = 1.0 / size.force, 1.0 / size.speed
    return (
        Quantity("inverse_limit", "1", 0.0, 10.0 * one, 0.1 * one, begins=one),
        Quantity("inverse_speed", "1", 0.0, 2.0 * per, 0.1 * per, amplitude=False, start=0.5 * per, later=True),
    )


EFFECT = Effect(
    name="torque_saturation",
    channel="actuation",
    quantities=_on_drive(DriveSize("effort_drive", 1.0, "1")),
    sentence="a limit of the drive's force",
    on=SINGLE_DRIVES,
    forces=_forces,
    model=_model,
    on_drive=_on_drive,
    by_name=True,
)

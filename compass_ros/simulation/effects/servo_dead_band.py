"""A position servo that does nothing while its error is small.

f = gain (e - min(max(e, -band), band)) - damping v in place of f = gain e - damping v, e the command less the position
as the servo has them, within the limits of its force. Source: dead band of a controller (the `dead zone` registers of
hobby servos), a dead zone in the error.
"""

from __future__ import annotations

import mujoco

from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.simulation.sites import Site
from compass_ros.simulation.sizes import DriveSize
from compass_ros.types import Floats


def _forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
    return tuple(Term(Kind.SERVO_DEAD_BAND, site, numbers) for site in context.sites)


def _unable(model: mujoco.MjModel, site: Site) -> str:
    delayed = model.actuator_historyadr[site.actuators[0]] >= 0
    return "MuJoCo delays its command" if delayed else ""


def _on_drive(size: DriveSize) -> tuple[Quantity, ...]:
    return (Quantity("band", size.unit, 0.0, 0.3 * size.command, 0.01 * size.command),)


EFFECT = Effect(
    name="servo_dead_band",
    channel="actuation",
    quantities=_on_drive(DriveSize("position_drive", 1.0, "1")),
    sentence="a dead band of the servo",
    on=("position_drive",),
    forces=_forces,
    on_drive=_on_drive,
    unable=_unable,
)

"""A drive that does nothing while little is asked of it.

Of a speed or a force: |u| -> max(|u| - band, 0), what dry friction within a drive takes.
Of a position servo: f = gain (e - (1 - punch) min(max(e, -band), band)) - damping v outside the band, and -damping v
within it, e the command less the position as the servo has them, within the limits of its force: a dead zone, which
begins from nothing at its edge, or, with `punch`, from that share of what the whole error would exert. Source: `dead
zone`, `compliance margin` and `punch` (the least current beyond the margin) among the registers of hobby servos.
"""

from __future__ import annotations

import mujoco
import numpy as np

from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.simulation.site_kinds import SPEED_DRIVES
from compass_ros.simulation.sites import Site
from compass_ros.simulation.sizes import DriveSize
from compass_ros.types import Floats


def _controls(controls: Floats, numbers: Floats, context: Context) -> Floats:
    if any(site.kind == "position_drive" for site in context.sites):
        return controls
    speed = np.linalg.norm(controls, axis=2, keepdims=True)
    return np.asarray(controls * np.maximum(1 - numbers[:, None, :1] / np.maximum(speed, 1e-12), 0))


def _forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
    servos = (site for site in context.sites if site.kind == "position_drive")
    return tuple(Term(Kind.SERVO_DEAD_BAND, site, numbers) for site in servos)


def _unable(model: mujoco.MjModel, site: Site) -> str:
    delayed = site.kind == "position_drive" and model.actuator_historyadr[site.actuators[0]] >= 0
    return "MuJoCo delays its command" if delayed else ""


def _on_drive(size: DriveSize) -> tuple[Quantity, ...]:
    """The shares of the largest command that are asked of a tool pushed at 0.5 m/s."""
    band = Quantity("band", size.unit, 0.0, 0.3 * size.command, 0.01 * size.command)
    punch = Quantity("punch", "1", 0.0, 1.0, 0.5, amplitude=False, start=0.5)
    return (band, punch) if size.kind == "position_drive" else (band,)


EFFECT = Effect(
    name="dead_band",
    channel="actuation",
    quantities=(Quantity("band", "m/s", 0.0, 0.15, 0.005),),
    sentence="a dead band of the drive",
    on=(*SPEED_DRIVES, "effort_drive", "position_drive"),
    controls=_controls,
    forces=_forces,
    on_drive=_on_drive,
    unable=_unable,
)

"""Drag that grows with speed.

F = -m rate v; on a joint F = -rate v, a torque (a force on a slide).
Source: Stokes drag and viscous shear of an air cushion, of grease in a bearing; all linear in the speed.
"""

from __future__ import annotations

from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.simulation.extents import BodySize
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.simulation.site_kinds import MOVING
from compass_ros.simulation.sizes import LARGEST, MODEST, JointSize
from compass_ros.types import Floats


def _forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
    return tuple(Term(Kind.VISCOUS, site, numbers) for site in context.sites)


def _on_joint(size: JointSize) -> tuple[Quantity, ...]:
    most = size.force / size.speed
    return (Quantity("rate", size.unit(" s/L"), 0.0, LARGEST * most, MODEST * most),)


def _on_body(size: BodySize) -> tuple[Quantity, ...]:
    most = size.acceleration / size.speed
    return (Quantity("rate", "1/s", 0.0, LARGEST * most, MODEST * most),)


EFFECT = Effect(
    name="viscous_drag",
    channel="dynamics",
    quantities=(Quantity("rate", "1/s", 0.0, 3.0, 0.05),),
    sentence="a drag proportional to speed",
    on=MOVING,
    forces=_forces,
    on_joint=_on_joint,
    on_body=_on_body,
)

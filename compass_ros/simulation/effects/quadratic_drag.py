"""Drag that grows with the square of the speed.

F = -m coefficient |v| v; on a joint F = -coefficient |v| v, a torque (a force on a slide).
Source: drag equation, coefficient = density C_d area / (2 m).
"""

from __future__ import annotations

from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.simulation.extents import BodySize
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.simulation.site_kinds import MOVING
from compass_ros.simulation.sizes import LARGEST, MODEST, JointSize
from compass_ros.types import Floats


def _forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
    return tuple(Term(Kind.QUADRATIC, site, numbers) for site in context.sites)


def _on_joint(size: JointSize) -> tuple[Quantity, ...]:
    most = size.force / size.speed**2
    return (Quantity("coefficient", size.unit(" s^2/L^2"), 0.0, LARGEST * most, MODEST * most),)


def _on_body(size: BodySize) -> tuple[Quantity, ...]:
    most = size.acceleration / size.speed**2
    return (Quantity("coefficient", "1/m", 0.0, LARGEST * most, MODEST * most),)


EFFECT = Effect(
    name="quadratic_drag",
    channel="dynamics",
    quantities=(Quantity("coefficient", "1/m", 0.0, 10.0, 0.2),),
    sentence="a drag proportional to the square of the speed",
    on=MOVING,
    forces=_forces,
    on_joint=_on_joint,
    on_body=_on_body,
)

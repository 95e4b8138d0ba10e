"""Drag that grows with speed.

F = -m rate v. Source: Stokes drag and viscous shear of the air cushion, both linear in the speed.
"""

from __future__ import annotations

from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.types import Floats


def _forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
    return tuple(Term(Kind.VISCOUS, name, numbers) for name in context.objects)


EFFECT = Effect(
    name="viscous_drag",
    channel="dynamics",
    quantities=(Quantity("rate", "1/s", 0.0, 3.0, 0.05),),
    sentence="a drag proportional to speed",
    forces=_forces,
)

"""Drag that grows with the square of the speed.

F = -m coefficient |v| v. Source: drag equation, coefficient = density C_d area / (2 m).
"""

from __future__ import annotations

from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.types import Floats


def _forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
    return tuple(Term(Kind.QUADRATIC, name, numbers) for name in context.objects)


EFFECT = Effect(
    name="quadratic_drag",
    channel="dynamics",
    quantities=(Quantity("coefficient", "1/m", 0.0, 10.0, 0.2),),
    sentence="a drag proportional to the square of the speed",
    forces=_forces,
)

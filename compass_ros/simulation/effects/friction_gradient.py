"""Friction that changes along the table.

F = -(along_x x + along_y y) N v / |v|, N the load on the table.
Source: first order of a coefficient that depends on the place.
"""

from __future__ import annotations

from compass_ros.simulation.effects.effect import Context, Effect, Quantity, friction
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.types import Floats


def _forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
    return friction(Kind.FRICTION_GRADIENT, context, numbers)


EFFECT = Effect(
    name="friction_gradient",
    channel="dynamics",
    quantities=(
        Quantity("along_x", "1/m", -0.3, 0.3, 0.02),
        Quantity("along_y", "1/m", -0.6, 0.6, 0.04),
    ),
    sentence="friction that changes along the table",
    on=("table",),
    forces=_forces,
)

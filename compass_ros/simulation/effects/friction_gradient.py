"""Friction that changes along the table.

F = -(along_x x + along_y y) N v / |v|, N the load on the table.
Source: first order of a coefficient that depends on the place. On a body in space the coefficient of each of its
contacts with what stands is larger by along_x x + along_y y, by the place of the contact.
"""

from __future__ import annotations

from compass_ros.simulation.contacts import slides_on_what_stands
from compass_ros.simulation.effects.effect import Context, Effect, Quantity, friction
from compass_ros.simulation.extents import BodySize
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.types import Floats


def _forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
    return friction(Kind.FRICTION_GRADIENT, context, numbers)


def _on_body(size: BodySize) -> tuple[Quantity, ...]:
    across = 1 / size.reach
    return (
        Quantity("along_x", "1/m", -0.5 * across, 0.5 * across, 0.02 * across),
        Quantity("along_y", "1/m", -0.5 * across, 0.5 * across, 0.02 * across),
    )


EFFECT = Effect(
    name="friction_gradient",
    channel="dynamics",
    quantities=(
        Quantity("along_x", "1/m", -0.3, 0.3, 0.02),
        Quantity("along_y", "1/m", -0.6, 0.6, 0.04),
    ),
    sentence="friction that changes along the table",
    on=("table", "body"),
    forces=_forces,
    on_body=_on_body,
    unable=slides_on_what_stands,
)

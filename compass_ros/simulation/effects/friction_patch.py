"""A patch with other friction.

F = -extra N v / |v| / (1 + exp(10 (r / radius - 1))), r from the centre, so inside `radius` with a soft edge; N is the
load on the table.
Source: Coulomb friction with a coefficient that depends on the place. Of a patch with a radius over 0.2 m only an edge
is on a table of 0.45 m: friction changes at a line then, or along the table. On a body in space the coefficient of each
of its contacts with what stands is larger by extra / (1 + ...), by the place of the contact.
"""

from __future__ import annotations

from compass_ros.simulation.contacts import slides_on_what_stands
from compass_ros.simulation.effects.effect import Context, Effect, Quantity, friction
from compass_ros.simulation.extents import BodySize
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.types import Floats


def _forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
    return friction(Kind.FRICTION_PATCH, context, numbers)


def _on_body(size: BodySize) -> tuple[Quantity, ...]:
    (x, y), r = size.middle, size.reach
    return (
        Quantity("extra", "1", -0.5, 1.0, 0.02),
        Quantity("centre_x", "m", x - r, x + r, 0.1 * r, amplitude=False, start=x),
        Quantity("centre_y", "m", y - r, y + r, 0.1 * r, amplitude=False, start=y),
        Quantity("radius", "m", 0.1 * r, r, 0.1 * r, amplitude=False, start=0.3 * r),
    )


EFFECT = Effect(
    name="friction_patch",
    channel="dynamics",
    quantities=(
        Quantity("extra", "1", -0.15, 0.6, 0.02),
        Quantity("centre_x", "m", -0.45, 0.45, 0.05, amplitude=False, start=0.0),
        Quantity("centre_y", "m", -0.225, 0.225, 0.05, amplitude=False, start=0.0),
        Quantity("radius", "m", 0.03, 0.3, 0.03, amplitude=False, start=0.1),
    ),
    sentence="a patch with other friction",
    on=("table", "body"),
    forces=_forces,
    on_body=_on_body,
    unable=slides_on_what_stands,
)

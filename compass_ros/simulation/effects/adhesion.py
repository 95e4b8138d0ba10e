"""Two bodies that stick to each other.

F = force along the normal, towards each other, while two geoms touch, shared by their contacts: to part them takes
so much more. Source: pull-off force of Derjaguin, Muller and Toporov 1975; applied as MuJoCo's adhesion actuator does.
"""

from __future__ import annotations

from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.simulation.extents import PairSize, unit_pair
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.simulation.sizes import LARGEST, MODEST
from compass_ros.types import Floats


def _forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
    return tuple(Term(Kind.ADHESION, site, numbers) for site in context.sites)


def _on_pair(size: PairSize) -> tuple[Quantity, ...]:
    weight = size.mass * size.acceleration
    return (Quantity("force", "N", 0.0, LARGEST * weight, MODEST * weight),)


EFFECT = Effect(
    name="adhesion",
    channel="contact",
    quantities=_on_pair(unit_pair("geom_pair")),
    sentence="adhesion between two bodies",
    on=("geom_pair",),
    forces=_forces,
    on_pair=_on_pair,
)

"""Two bodies that stick to each other.

F = force (1 - hysteresis c) along the normal, towards each other, while two geoms touch, shared by their contacts; c is
1 while they come together and 0 while they part: to part them takes more than they attract, and a cycle loses the
difference. Source: pull-off force of Derjaguin, Muller and Toporov 1975; hysteresis of Chaudhury and Whitesides 1991,
Langmuir 7, 1013. Applied as MuJoCo's adhesion actuator does, whose hysteresis is 0.
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
    return (
        Quantity("force", "N", 0.0, LARGEST * weight, MODEST * weight),
        Quantity("hysteresis", "1", 0.0, 1.0, 0.1, amplitude=False, later=True, grid=1),
    )


EFFECT = Effect(
    name="adhesion",
    channel="contact",
    quantities=_on_pair(unit_pair("geom_pair")),
    sentence="adhesion between two bodies",
    on=("geom_pair",),
    forces=_forces,
    on_pair=_on_pair,
)

"""A cable between two bodies that drags once it is taut.

F = stiffness (r - length) towards each other where r > length, r from one centre of mass to the other, else nothing.
Source: Hooke's law of a cable without weight that cannot push.
"""

from __future__ import annotations

from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.simulation.extents import PairSize, unit_pair
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.simulation.sizes import LARGEST, MODEST
from compass_ros.types import Floats


def _forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
    return tuple(Term(Kind.TETHER, site, numbers) for site in context.sites)


def _on_pair(size: PairSize) -> tuple[Quantity, ...]:
    """Taut somewhere on the way: a longer one is never felt."""
    most, far = size.mass * size.acceleration / size.distance, size.distance
    return (
        Quantity("stiffness", "N/m", 0.0, LARGEST * most, MODEST * most),
        Quantity("length", "m", 0.0, 3.0 * far, 0.3 * far, amplitude=False, start=0.7 * far),
    )


EFFECT = Effect(
    name="tether",
    channel="dynamics",
    quantities=_on_pair(unit_pair("body_pair")),
    sentence="a cable between two bodies",
    on=("body_pair",),
    forces=_forces,
    on_pair=_on_pair,
)

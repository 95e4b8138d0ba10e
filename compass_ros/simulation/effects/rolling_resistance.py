"""A body that rolls less far than the scene says.

M = -lever N w / |w|, w the relative spin about axes in the plane of contact, N the load that contacts alike carry of
two free bodies under gravity; faded in over what the couple itself stops within a step.
Source: Coulomb's law of rolling friction; `lever` is the offset of the load's line of action (Johnson 1985, ch. 9).
"""

from __future__ import annotations

from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.simulation.extents import PairSize, unit_pair
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.simulation.sizes import MODEST
from compass_ros.types import Floats


def _forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
    return tuple(Term(Kind.ROLLING, site, numbers) for site in context.sites)


def _on_pair(size: PairSize) -> tuple[Quantity, ...]:
    """Of a lever as long as the body itself nothing rolls; steel on steel has thousandths, a ball on grass tenths."""
    return (Quantity("lever", "m", 0.0, size.extent, 0.1 * MODEST * size.extent),)


EFFECT = Effect(
    name="rolling_resistance",
    channel="contact",
    quantities=_on_pair(unit_pair("geom_pair")),
    sentence="rolling resistance",
    on=("geom_pair",),
    forces=_forces,
    on_pair=_on_pair,
)

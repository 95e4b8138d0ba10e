"""Two bodies that pull at each other or push each other away: magnets, static charge.

F = strength (3 sqrt(3) / 2) core^2 r / (r^2 + core^2)^(3/2) towards each other, r from one centre of mass to the
other, negative for repulsion; the peak lies at core / sqrt(2). Source: inverse-square law, softened (Plummer 1911).
"""

from __future__ import annotations

from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.simulation.extents import PairSize, unit_pair
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.simulation.sizes import LARGEST, MODEST
from compass_ros.types import Floats


def _forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
    return tuple(Term(Kind.PAIR_ATTRACTION, site, numbers) for site in context.sites)


def _on_pair(size: PairSize) -> tuple[Quantity, ...]:
    """With a core far smaller than the least distance only strength core^2 counts."""
    weight, near = size.mass * size.acceleration, size.nearest
    return (
        Quantity("strength", "N", -LARGEST * weight, LARGEST * weight, MODEST * weight),
        Quantity("core", "m", 0.3 * near, 10.0 * near, 0.5 * near, amplitude=False, start=near),
    )


EFFECT = Effect(
    name="pair_attraction",
    channel="dynamics",
    quantities=_on_pair(unit_pair("body_pair")),
    sentence="an attraction between two bodies",
    on=("body_pair",),
    forces=_forces,
    on_pair=_on_pair,
)

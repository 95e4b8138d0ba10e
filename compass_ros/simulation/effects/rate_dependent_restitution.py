"""Restitution that falls with the speed of impact.

A contact's damping grows by the factor 1 + slope |v_n|, v_n the speed along the normal at each moment.
Source: first order of a damping that depends on speed, as in Hunt and Crossley 1975. Of a pair that goes at v, rms, it
stays above half of itself up to there, and grows up to 20 times: pucks lose little to begin with.
"""

from __future__ import annotations

from compass_ros.simulation.effects.effect import Context, Effect, Quantity, on_contacts
from compass_ros.simulation.extents import PairSize
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.types import Floats


def _forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
    return on_contacts(Kind.RATE_RESTITUTION, context, numbers)


def _on_pair(size: PairSize) -> tuple[Quantity, ...]:
    return (Quantity("slope", "s/m", -0.5 / size.speed, 20 / size.speed, 0.3 / size.speed),)


EFFECT = Effect(
    name="rate_dependent_restitution",
    channel="contact",
    quantities=(Quantity("slope", "s/m", -0.8, 20.0, 0.5),),
    sentence="a restitution that depends on the speed of impact",
    on=("contacts", "geom_pair"),
    forces=_forces,
    on_pair=_on_pair,
)

"""The weight of the fluid that a body displaces.

F = -share m g, g the scene's gravity, at the centre of mass; `share` is the fluid's density over the body's mean one.
Source: Archimedes' principle; the mass of the fluid that moves along is left out.
"""

from __future__ import annotations

from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.simulation.effects.gravity_tilt import weightless
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.simulation.sizes import MODEST
from compass_ros.types import Floats


def _forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
    return tuple(Term(Kind.BUOYANCY, site, numbers) for site in context.sites)


EFFECT = Effect(
    name="buoyancy",
    channel="dynamics",
    quantities=(Quantity("share", "1", 0.0, 2.0, MODEST),),
    sentence="buoyancy",
    on=("body",),
    forces=_forces,
    unable=weightless,
)

"""A push outwards from a point, as above a fan.

F = m strength u (1 + tail (u^2 - 1) / 2)^(-1 / tail), u = r / radius, away from the centre; peak at u = 1.
A tail of 0 is the limit u exp((1 - u^2) / 2), a tail of 1 falls as 1 / r, as the speed of a radial wall jet does.
Source: one-peaked profiles of radial jets (Glauert, J. Fluid Mech. 1, 1956: speed falls about as 1 / r).
"""

from __future__ import annotations

from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.simulation.site_kinds import PLANAR
from compass_ros.types import Floats


def _forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
    return tuple(Term(Kind.FAN, site, numbers) for site in context.sites)


EFFECT = Effect(
    name="fan_field",
    channel="dynamics",
    quantities=(
        Quantity("strength", "m/s^2", 0.0, 3.0, 0.05),
        Quantity("centre_x", "m", -0.45, 0.45, 0.05, amplitude=False, start=0.0),
        Quantity("centre_y", "m", -0.225, 0.225, 0.05, amplitude=False, start=0.0),
        Quantity("radius", "m", 0.03, 0.4, 0.03, amplitude=False, start=0.12),
        Quantity("tail", "1", 0.0, 1.2, 0.3, amplitude=False, start=0.5),
    ),
    sentence="an outward push",
    on=PLANAR,
    forces=_forces,
)

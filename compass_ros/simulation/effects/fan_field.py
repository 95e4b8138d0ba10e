"""A push outwards from a point, as above a fan.

F = m strength (r / radius) exp((1 - r^2 / radius^2) / 2) away from the centre; the peak, `strength`, lies at `radius`.
Source: a smooth one-peaked profile of a radial wall jet; the exact profile matters little at the resolution of a puck.
"""

from __future__ import annotations

from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.types import Floats


def _forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
    return tuple(Term(Kind.FAN, name, numbers) for name in context.objects)


EFFECT = Effect(
    name="fan_field",
    channel="dynamics",
    quantities=(
        Quantity("strength", "m/s^2", 0.0, 3.0, 0.05),
        Quantity("centre_x", "m", -0.45, 0.45, 0.05, amplitude=False, start=0.0),
        Quantity("centre_y", "m", -0.225, 0.225, 0.05, amplitude=False, start=0.0),
        Quantity("radius", "m", 0.03, 0.4, 0.03, amplitude=False, start=0.12),
    ),
    sentence="an outward push",
    forces=_forces,
)

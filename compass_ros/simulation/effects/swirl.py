"""A push around a point.

F = m strength (r / radius) exp((1 - r^2 / radius^2) / 2) anticlockwise around the centre; the peak lies at `radius`.
Source: Lamb-Oseen-like vortex with a finite core.
"""

from __future__ import annotations

from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.types import Floats


def _forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
    return tuple(Term(Kind.SWIRL, name, numbers) for name in context.objects)


EFFECT = Effect(
    name="swirl",
    channel="dynamics",
    quantities=(
        Quantity("strength", "m/s^2", -3.0, 3.0, 0.05),
        Quantity("centre_x", "m", -0.45, 0.45, 0.05, amplitude=False, start=0.0),
        Quantity("centre_y", "m", -0.225, 0.225, 0.05, amplitude=False, start=0.0),
        Quantity("radius", "m", 0.03, 0.4, 0.03, amplitude=False, start=0.12),
    ),
    sentence="a push around a point",
    forces=_forces,
)

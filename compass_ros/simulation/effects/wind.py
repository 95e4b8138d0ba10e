"""A steady stream of air around a body in space.

F = m coefficient (|w - v| (w - v) + |v| v), w = (wind_x, wind_y, wind_z) the velocity of the air: what a stream adds to
the drag in air at rest, which the scene has, or `quadratic_drag`. Source: drag equation with the velocity relative to
the air.
"""

from __future__ import annotations

from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.simulation.extents import BodySize, unit_body
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.simulation.sizes import LARGEST, MODEST
from compass_ros.types import Floats

_LIGHTEST = 0.01
"""Drag over the larger of gravity and what turns the body: of a steel ball; a tenth is a football's."""


def _forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
    return tuple(Term(Kind.WIND, site, numbers) for site in context.sites)


def _on_body(size: BodySize) -> tuple[Quantity, ...]:
    most, v = size.acceleration / size.speed**2, size.speed
    stream = [Quantity(f"wind_{axis}", "m/s", -LARGEST * v, LARGEST * v, MODEST * v) for axis in "xyz"]
    low, high = _LIGHTEST * most, LARGEST * most
    return (*stream, Quantity("coefficient", "1/m", low, high, 0.1 * most, amplitude=False, start=0.1 * most))


EFFECT = Effect(
    name="wind",
    channel="dynamics",
    quantities=_on_body(unit_body()),
    sentence="a steady stream of air",
    on=("body",),
    forces=_forces,
    on_body=_on_body,
)

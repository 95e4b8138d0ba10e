"""A steady stream of air around a body in space.

F = m a |w - v| (w - v) / speed^2, a = |(acceleration_x, acceleration_y, acceleration_z)| what the body at rest feels, w
the velocity of the air, `speed` in that direction; in a scene that has air at rest, + m a |v| v / speed^2: what the
stream adds to that. Source: drag equation with the velocity relative to the air; a fast stream is a constant push.
`crosswind` in three dimensions.
"""

from __future__ import annotations

from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.simulation.extents import BodySize, unit_body
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.simulation.sizes import LARGEST, MODEST
from compass_ros.types import Floats


def _forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
    return tuple(Term(Kind.WIND, site, numbers) for site in context.sites)


def _on_body(size: BodySize) -> tuple[Quantity, ...]:
    """Air that is much slower than the body is still air, which `quadratic_drag` is about. A search begins with a fast
    stream: the push is nearly in proportion to the acceleration there, whatever its direction."""
    most, scale, v = LARGEST * size.acceleration, MODEST * size.acceleration, size.speed
    pushes = [Quantity(f"acceleration_{axis}", "m/s^2", -most, most, scale) for axis in "xyz"]
    return (*pushes, Quantity("speed", "m/s", 0.3 * v, 30.0 * v, v, amplitude=False, start=10.0 * v))


EFFECT = Effect(
    name="wind",
    channel="dynamics",
    quantities=_on_body(unit_body()),
    sentence="a steady stream of air",
    on=("body",),
    forces=_forces,
    on_body=_on_body,
    superposes=False,
)

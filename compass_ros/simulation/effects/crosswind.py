"""A steady stream of air across the table.

F = m a |w - v| (w - v) / speed^2, a = |(acceleration_x, acceleration_y)| what a body at rest feels, w the velocity of
the air, `speed` in that direction. Source: drag equation with the velocity relative to the air; a fast stream pushes as
a tilt does.
"""

from __future__ import annotations

from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.simulation.site_kinds import PLANAR
from compass_ros.types import Floats


def _forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
    return tuple(Term(Kind.CROSSWIND, site, numbers) for site in context.sites)


EFFECT = Effect(
    name="crosswind",
    channel="dynamics",
    quantities=(
        Quantity("acceleration_x", "m/s^2", -0.5, 0.5, 0.03),
        Quantity("acceleration_y", "m/s^2", -0.5, 0.5, 0.03),
        Quantity("speed", "m/s", 0.3, 10.0, 1.0, amplitude=False, start=1.5),
    ),
    sentence="a steady stream of air across the table",
    on=PLANAR,
    forces=_forces,
    superposes=False,
)

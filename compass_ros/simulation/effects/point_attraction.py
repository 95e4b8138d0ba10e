"""A pull towards a point.

F = -m strength (3 sqrt(3) / 2) core^2 r / (r^2 + core^2)^(3/2), r from the centre; the peak lies at core / sqrt(2).
Source: inverse-square law of a magnet or sink under the table at the depth `core`, its component in the plane.
"""

from __future__ import annotations

from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.simulation.site_kinds import PLANAR
from compass_ros.types import Floats


def _forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
    return tuple(Term(Kind.ATTRACTION, site, numbers) for site in context.sites)


EFFECT = Effect(
    name="point_attraction",
    channel="dynamics",
    quantities=(
        Quantity("strength", "m/s^2", 0.0, 3.0, 0.05),
        Quantity("centre_x", "m", -0.45, 0.45, 0.05, amplitude=False, start=0.0),
        Quantity("centre_y", "m", -0.225, 0.225, 0.05, amplitude=False, start=0.0),
        Quantity("core", "m", 0.02, 0.3, 0.03, amplitude=False, start=0.08),
    ),
    sentence="a pull towards a point",
    on=PLANAR,
    forces=_forces,
)

"""A table that is not level.

F = m g (tilt_x, tilt_y), the component of gravity along a surface tilted by small angles; positive pushes along +x, +y.
Source: resolution of the weight on an inclined plane, sin(tilt) ~ tilt under 0.05 rad (error 0.04 %).
"""

from __future__ import annotations

from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.simulation.site_kinds import LYING
from compass_ros.types import Floats


def _forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
    return tuple(Term(Kind.TILT, site, numbers) for site in context.sites)


EFFECT = Effect(
    name="table_tilt",
    channel="dynamics",
    quantities=(
        Quantity("tilt_x", "rad", -0.05, 0.05, 0.003),
        Quantity("tilt_y", "rad", -0.05, 0.05, 0.003),
    ),
    sentence="a tilt of the table",
    on=LYING,
    forces=_forces,
)

"""Gravity that points elsewhere: a base or a camera's frame that is not level.

F = m (g' - g), g' gravity turned by the small rotation that pushes along +x for a positive `tilt_x` and along +y for
`tilt_y` (two axes across gravity; those of the world where it points down z).
Source: resolution of the weight in a tilted frame, exact in the angles.
"""

from __future__ import annotations

import mujoco

from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.simulation.sites import Site
from compass_ros.types import Floats


def _forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
    return tuple(Term(Kind.GRAVITY_TILT, site, numbers) for site in context.sites)


def weightless(model: mujoco.MjModel, site: Site) -> str:
    """Why what needs a weight cannot act; empty: it can."""
    return "" if model.opt.gravity.any() else "the scene has no gravity"


EFFECT = Effect(
    name="gravity_tilt",
    channel="dynamics",
    quantities=(Quantity("tilt_x", "rad", -0.3, 0.3, 0.02), Quantity("tilt_y", "rad", -0.3, 0.3, 0.02)),
    sentence="a tilt of gravity",
    on=("body",),
    forces=_forces,
    unable=weightless,
    on_links="all",
)

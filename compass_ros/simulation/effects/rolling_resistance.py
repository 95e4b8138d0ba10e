"""A body that rolls less far than the scene says.

M = -lever N w / |w|, w the relative spin about axes in the plane of contact, N the load that contacts alike carry of
two free bodies under gravity; faded in over what the couple itself stops within a step.
Source: Coulomb's law of rolling friction; `lever` is the offset of the load's line of action (Johnson 1985, ch. 9).
"""

from __future__ import annotations

import mujoco

from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.simulation.extents import PairSize, unit_pair
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.simulation.sites import Site, carriers, slides_in_plane
from compass_ros.simulation.sizes import MODEST
from compass_ros.types import Floats


def _forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
    return tuple(Term(Kind.ROLLING, site, numbers) for site in context.sites)


def _on_pair(size: PairSize) -> tuple[Quantity, ...]:
    """Of a lever as long as the body itself nothing rolls; steel on steel has thousandths, a ball on grass tenths."""
    return (Quantity("lever", "m", 0.0, size.extent, 0.1 * MODEST * size.extent),)


def _unable(model: mujoco.MjModel, site: Site) -> str:
    bodies = [int(model.body_weldid[model.geom(name).bodyid[0]]) for name in site.names]
    return "" if any(_rolls(model, body) for body in bodies) else "neither of the two can roll"


def _rolls(model: mujoco.MjModel, body: int) -> bool:
    """Whether it, or what carries it, can turn, but for one that stays upright on a plane."""
    turning = {mujoco.mjtJoint.mjJNT_FREE, mujoco.mjtJoint.mjJNT_BALL, mujoco.mjtJoint.mjJNT_HINGE}
    for one in carriers(model, body):
        first = int(model.body_jntadr[one])
        kinds = set(model.jnt_type[first : first + int(model.body_jntnum[one])].tolist())
        if kinds & turning and not slides_in_plane(model, one):
            return True
    return False


EFFECT = Effect(
    name="rolling_resistance",
    channel="contact",
    quantities=_on_pair(unit_pair("geom_pair")),
    sentence="rolling resistance",
    on=("geom_pair",),
    forces=_forces,
    on_pair=_on_pair,
    unable=_unable,
)

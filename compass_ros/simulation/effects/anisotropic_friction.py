"""Friction that depends on the direction of motion.

F = -N A v / |v|, A = [[along_x, diagonal], [diagonal, -along_x]] the traceless part of a friction tensor, N the load
on the table. Source: Zmitrowicz 2006, friction tensors of second order; the isotropic part is the usual coefficient.
On a body in space this is added to MuJoCo's friction in each of its contacts with what stands, to first order in A:
half by an elliptic cone, whose force turns from the slip twice as far (it is where most power is lost), half by the
slip's direction.
"""

from __future__ import annotations

import mujoco

from compass_ros.simulation.contacts import slides_on_what_stands
from compass_ros.simulation.effects.effect import Context, Effect, Quantity, friction
from compass_ros.simulation.extents import BodySize
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.simulation.sites import Site
from compass_ros.types import Floats


def _forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
    return friction(Kind.ANISOTROPIC, context, numbers)


def _unable(model: mujoco.MjModel, site: Site) -> str:
    if site.kind == "body" and model.opt.cone != mujoco.mjtCone.mjCONE_ELLIPTIC:
        return 'the scene\'s pyramidal cone has directions of its own; give it cone="elliptic"'
    return slides_on_what_stands(model, site)


def _on_body(size: BodySize) -> tuple[Quantity, ...]:
    return tuple(Quantity(name, "1", -0.5, 0.5, 0.02) for name in ("along_x", "diagonal"))


EFFECT = Effect(
    name="anisotropic_friction",
    channel="dynamics",
    quantities=(
        Quantity("along_x", "1", -0.1, 0.1, 0.005),
        Quantity("diagonal", "1", -0.1, 0.1, 0.005),
    ),
    sentence="friction that depends on the direction of motion",
    on=("table", "body"),
    forces=_forces,
    on_body=_on_body,
    unable=_unable,
)

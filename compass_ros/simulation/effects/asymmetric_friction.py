"""Dry friction that is another one in each direction.

F = -difference v / |v| while v > 0 and nothing while v < 0, a torque (a force on a slide): by so much dry friction
forwards is higher than backwards. Beside a dry friction, which both directions have; where `difference` is negative
that has to be at least as large, or the joint would be pushed.
Source: direction-dependent Coulomb friction of geared joints (Armstrong-Helouvry, Dupont and Canudas de Wit 1994,
sec. 2). It holds or creeps as the joint's own dry friction does.
"""

from __future__ import annotations

from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.simulation.site_kinds import JOINTS
from compass_ros.simulation.sizes import LARGEST, MODEST, JointSize, unit_joint
from compass_ros.types import Floats


def _forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
    return tuple(Term(Kind.ASYMMETRIC, site, numbers) for site in context.sites)


def _on_joint(size: JointSize) -> tuple[Quantity, ...]:
    most = LARGEST * size.force
    return (Quantity("difference", size.force_unit, -most, most, MODEST * size.force),)


EFFECT = Effect(
    name="asymmetric_friction",
    channel="dynamics",
    quantities=_on_joint(unit_joint("hinge")),
    sentence="dry friction that is another one in each direction",
    on=JOINTS,
    forces=_forces,
    on_joint=_on_joint,
)

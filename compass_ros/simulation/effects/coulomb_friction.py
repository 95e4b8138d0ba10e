"""Dry friction that does not depend on speed.

F = -coefficient N v / |v|; on a joint F = -coefficient v / |v|, a torque (a force on a slide).
Source: Coulomb friction; of bodies faded in at a creep speed, of a joint at rest whatever force below `coefficient`
holds it there. Where a cell tunes sliding friction already, this is the same thing and so never seen.
"""

from __future__ import annotations

from compass_ros.simulation.effects.effect import Context, Effect, Quantity, friction
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.simulation.sites import JOINTS, LYING
from compass_ros.simulation.sizes import LARGEST, MODEST, JointSize
from compass_ros.types import Floats


def _forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
    return friction(Kind.COULOMB, context, numbers)


def _on_joint(size: JointSize) -> tuple[Quantity, ...]:
    return (Quantity("coefficient", size.force_unit, 0.0, LARGEST * size.force, MODEST * size.force),)


EFFECT = Effect(
    name="coulomb_friction",
    channel="dynamics",
    quantities=(Quantity("coefficient", "1", 0.0, 1.0, 0.01),),
    sentence="dry friction",
    on=(*LYING, *JOINTS),
    forces=_forces,
    on_joint=_on_joint,
)

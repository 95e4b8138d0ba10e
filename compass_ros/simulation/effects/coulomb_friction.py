"""Dry friction that does not depend on speed.

F = -coefficient N v / |v|; on a joint F = -coefficient v / |v|, a torque (a force on a slide).
Source: Coulomb friction; of bodies faded in at a creep speed. A joint at rest is held by whatever force below
`coefficient` does it. Engines soften that: with a `softness` the joint comes to rest within this time, and creeps under
load, as by MuJoCo's `frictionloss` (0.0095 s at its defaults); 0: it stays where it is. Where a cell tunes sliding
friction already, this is the same thing and so never seen.
"""

from __future__ import annotations

from compass_ros.simulation.effects.effect import Context, Effect, Quantity, friction
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.simulation.site_kinds import JOINTS, LYING
from compass_ros.simulation.sizes import LARGEST, MODEST, JointSize
from compass_ros.types import Floats

SOFTEST_S = 0.05
"""Longest time constant that is asked. A shape's prior is a quarter of its range wide (`hypothesis.widened`), 0.0125 s
here: friction that holds (0) and MuJoCo's own (0.0095 s) are both within one standard deviation of it."""


def _forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
    return friction(Kind.COULOMB, context, numbers[:, :1], softness=numbers[:, 1:])


def _on_joint(size: JointSize) -> tuple[Quantity, ...]:
    return (
        Quantity("coefficient", size.force_unit, 0.0, LARGEST * size.force, MODEST * size.force),
        Quantity("softness", "s", 0.0, SOFTEST_S, 0.1 * SOFTEST_S, amplitude=False, later=True, grid=1),
    )


EFFECT = Effect(
    name="coulomb_friction",
    channel="dynamics",
    quantities=(Quantity("coefficient", "1", 0.0, 1.0, 0.01),),
    sentence="dry friction",
    on=(*LYING, *JOINTS),
    forces=_forces,
    on_joint=_on_joint,
)

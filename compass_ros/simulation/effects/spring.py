"""A spring that the model lacks, or a cable that bends.

F = -stiffness (q - rest), a torque on a hinge, a force on a slide. Source: Hooke's law.
"""

from __future__ import annotations

from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.simulation.sites import JOINTS
from compass_ros.simulation.sizes import LARGEST, MODEST, JointSize, unit_joint
from compass_ros.types import Floats


def _forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
    return tuple(Term(Kind.SPRING, site, numbers) for site in context.sites)


def _on_joint(size: JointSize) -> tuple[Quantity, ...]:
    """With a rest beyond the ends of what was seen it would rather be a constant push."""
    most, reach = size.force / size.spread, 3.0 * size.spread
    return (
        Quantity("stiffness", size.unit("/L"), 0.0, LARGEST * most, MODEST * most),
        Quantity(
            "rest",
            size.length_unit,
            size.middle - reach,
            size.middle + reach,
            size.spread,
            amplitude=False,
            start=size.middle,
        ),
    )


EFFECT = Effect(
    name="spring",
    channel="dynamics",
    quantities=_on_joint(unit_joint("hinge")),
    sentence="a spring",
    on=JOINTS,
    forces=_forces,
    on_joint=_on_joint,
)

"""Dry friction in proportion to the load that a gear transmits.

F = -(coefficient + at_rest exp(-(v / speed)^2)) L v / |v|, L = |qfrc_actuator + qfrc_applied| of the joint: what drives
it, as the gear sees it from the motor's side (gravity, acceleration and contacts count as far as the drive answers
them). Nothing on a joint that nothing drives, nor beside an elasticity or a play, where the drive loads the motor's
side. Source: Hamon, Gautier and Garrec 2010, friction of a transmission that depends on load and speed, its term in the
load; that this is higher when slow: Duclusaud et al. 2025 (BAM), with the Gaussian of stribeck_friction.
"""

from __future__ import annotations

from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.simulation.site_kinds import JOINTS
from compass_ros.simulation.sizes import MODEST, JointSize, unit_joint
from compass_ros.types import Floats


def _forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
    return tuple(Term(Kind.LOAD_FRICTION, site, numbers) for site in context.sites)


def _on_joint(size: JointSize) -> tuple[Quantity, ...]:
    """Shares of a force in any unit; at 1 the drive could not move the joint at all. What fades by half of the
    fastest that was seen is told from what does not."""
    v = size.fastest
    return (
        Quantity("coefficient", "1", 0.0, 1.0, MODEST),
        Quantity("at_rest", "1", 0.0, 1.0, MODEST, later=True),
        Quantity(
            "speed", f"{size.length_unit}/s", 0.01 * v, 0.5 * v, 0.1 * v, amplitude=False, start=0.2 * v, later=True
        ),
    )


EFFECT = Effect(
    name="load_dependent_friction",
    channel="dynamics",
    quantities=_on_joint(unit_joint("hinge")),
    sentence="friction in proportion to the load",
    on=JOINTS,
    forces=_forces,
    on_joint=_on_joint,
    loaded=True,
    by_name=True,
)

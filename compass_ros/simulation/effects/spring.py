"""A spring that the model lacks, or a cable that bends.

F = -stiffness x, x = q - rest, a force on a slide; on a hinge F = -stiffness (1 - slack s cos(s x)) sin(s x) / s, a
torque, with s = softening, which is the same at 0. At 1 it is k a b sin x of a helical spring between two points beside
the axis, a and b away from it, as they balance arms; slack is what a free length takes of that where the points are
near, to first order in a b / (a^2 + b^2). Below 0 it stiffens: F = -stiffness sinh(s x) / s with s = -softening, no
slack.
Source: Hooke's law; Herder 2001, Energy-free systems, ch. 3 (springs of zero free length, and what another one adds);
Fung 1967, Am. J. Physiol. 213, 1532 (stress of a fibre that stiffens, an exponential of its strain).
"""

from __future__ import annotations

import math

from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.simulation.site_kinds import JOINTS
from compass_ros.simulation.sizes import LARGEST, MODEST, JointSize, unit_joint
from compass_ros.types import Floats

NEAR, FARTHEST = 3.0, 10.0
"""How far from the middle of what was seen a spring may rest, in spreads; the second of a hinge, up to half a turn.
Farther out it would be a constant push but for a tenth, and one that stiffens would overflow."""


def _forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
    return tuple(Term(Kind.SPRING, site, numbers) for site in context.sites)


def _on_joint(size: JointSize) -> tuple[Quantity, ...]:
    """A hinge's spring that is wound up, or carries a link, rests where no motion comes."""
    most, reach = size.force / size.spread, NEAR * size.spread
    if size.kind == "hinge":
        reach = max(reach, min(math.pi, FARTHEST * size.spread))
    softening = Quantity("softening", "1", -2.0 / size.spread, 1.0, 0.5, amplitude=False, later=True)
    slack = Quantity("slack", "1", 0.0, 2.0, 0.1, amplitude=False, later=True, grid=5)
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
        *([softening, slack] if size.kind == "hinge" else []),
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

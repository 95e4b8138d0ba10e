"""A torque that repeats with the angle, as between the magnets and teeth of a motor or from the teeth of a gear.

F = cosine cos(periods q) + sine sin(periods q) + cosine_2 cos(2 periods q) + sine_2 sin(2 periods q) + cosine_3 cos(3
periods q) + sine_3 sin(3 periods q), a torque; `periods` per turn. Source: the first three harmonics of the cogging
torque (Hanselman 2003, ch. 5); behind a gear `periods` need be no whole number.
"""

from __future__ import annotations

import numpy as np

from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.simulation.sizes import LARGEST, MODEST, JointSize, unit_joint
from compass_ros.types import Floats

_FINEST = 100.0
"""Periods within the travel; finer ones a joint with any inertia hardly feels, and samples hardly show."""
_GRID = 1 + round(2 * (_FINEST - 1))
"""Places half a period within the travel apart: a quarter off, the two ends of the travel are a quarter turn out."""


def _forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
    return tuple(Term(Kind.COGGING, site, numbers) for site in context.sites)


def _on_joint(size: JointSize) -> tuple[Quantity, ...]:
    """Of less than a period within the travel (uniform: sqrt(12) spreads) one sees a constant push or a spring.

    Harmonics fall: half as much is expected of the second and a third of the third, so that these are not taken for the
    first of fewer teeth.
    """
    once = max(1.0, 2 * np.pi / (np.sqrt(12) * size.spread))
    most, scale = LARGEST * size.force, MODEST * size.force
    return (
        Quantity("cosine", size.force_unit, -most, most, scale),
        Quantity("sine", size.force_unit, -most, most, scale),
        Quantity("periods", "1", once, _FINEST * once, once, amplitude=False, start=4 * once, grid=_GRID),
        Quantity("cosine_2", size.force_unit, -most / 2, most / 2, scale / 2, later=True),
        Quantity("sine_2", size.force_unit, -most / 2, most / 2, scale / 2, later=True),
        Quantity("cosine_3", size.force_unit, -most / 3, most / 3, scale / 3, later=True),
        Quantity("sine_3", size.force_unit, -most / 3, most / 3, scale / 3, later=True),
    )


EFFECT = Effect(
    name="cogging",
    channel="dynamics",
    quantities=_on_joint(unit_joint("hinge")),
    sentence="a torque that repeats with the angle",
    on=("hinge",),
    forces=_forces,
    on_joint=_on_joint,
    by_name=True,
)

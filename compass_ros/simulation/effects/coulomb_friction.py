"""Dry friction that does not depend on speed.

F = -coefficient N v / |v|; on a joint the coefficient is a torque [N m]. Source: Coulomb friction, faded in at a creep
speed. Where a cell tunes sliding friction already, this is the same thing and so never seen.
"""

from __future__ import annotations

import numpy as np

from compass_ros.simulation.effects.effect import Context, Effect, Quantity, creep_and_load
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.types import Floats


def _forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
    terms = []
    for name in context.objects:
        if name in context.sliding:
            creep, load = creep_and_load(context, name)
        else:  # a joint, or a body off the table: the friction is a torque [N m], faded in at 1 mrad/s (1 mm/s)
            creep, load = np.full((len(numbers), 1), 1e-3), np.ones((len(numbers), 1))
        terms.append(Term(Kind.COULOMB, name, np.hstack([numbers, creep, load])))
    return tuple(terms)


EFFECT = Effect(
    name="coulomb_friction",
    channel="dynamics",
    quantities=(Quantity("coefficient", "1", 0.0, 1.0, 0.01),),
    sentence="dry friction",
    forces=_forces,
)

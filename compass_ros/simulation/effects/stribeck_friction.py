"""Friction that is higher when slow.

F = -extra exp(-(v / speed)^2) N v / |v| on top of the ordinary friction; on a joint `extra` is a torque [N m].
Source: Stribeck curve in the form of Armstrong-Helouvry 1994, Gaussian exponent 2. The speeds of contacts are below
0.1 m/s there; with more than 0.3 m/s it is no friction of low speeds: a drag that falls at speed looks like that.
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
        terms.append(Term(Kind.STRIBECK, name, np.hstack([numbers[:, :1], creep, load, numbers[:, 1:]])))
    return tuple(terms)


EFFECT = Effect(
    name="stribeck_friction",
    channel="dynamics",
    quantities=(
        Quantity("extra", "1", 0.0, 0.5, 0.02),
        Quantity("speed", "m/s", 0.01, 1.0, 0.05, amplitude=False, start=0.1, most=0.3),
    ),
    sentence="higher friction at low speed (Stribeck)",
    forces=_forces,
)

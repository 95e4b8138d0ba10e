"""Friction between rims in a collision, which turns pucks and deflects them.

F_t = -friction F_n v_t / |v_t|, faded in at 10 mm/s, with F_n the force along the normal of a contact that is alone.
Source: Coulomb friction in planar impact (Walton 1993).
"""

from __future__ import annotations

import numpy as np

from compass_ros.simulation.effects.effect import Context, Effect, Quantity, on_contacts
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.types import Floats

_CREEP = 0.01  # m/s


def _forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
    return on_contacts(Kind.TANGENTIAL, context, np.hstack([numbers, np.full_like(numbers, _CREEP)]))


EFFECT = Effect(
    name="tangential_impulse",
    channel="contact",
    quantities=(Quantity("friction", "1", 0.0, 0.8, 0.03),),
    sentence="friction between the rims in contacts",
    on=("contacts", "geom_pair"),
    forces=_forces,
)

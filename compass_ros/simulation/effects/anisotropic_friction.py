"""Friction that depends on the direction of motion.

F = -N A v / |v|, A = [[along_x, diagonal], [diagonal, -along_x]] the traceless part of a friction tensor, N the load
on the table. Source: Zmitrowicz 2006, friction tensors of second order; the isotropic part is the usual coefficient.
"""

from __future__ import annotations

from compass_ros.simulation.effects.effect import Context, Effect, Quantity, friction
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.types import Floats


def _forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
    return friction(Kind.ANISOTROPIC, context, numbers)


EFFECT = Effect(
    name="anisotropic_friction",
    channel="dynamics",
    quantities=(
        Quantity("along_x", "1", -0.1, 0.1, 0.005),
        Quantity("diagonal", "1", -0.1, 0.1, 0.005),
    ),
    sentence="friction that depends on the direction of motion",
    on=("table",),
    forces=_forces,
)

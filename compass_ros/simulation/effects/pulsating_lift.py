"""Friction that pulsates in time, as under a fan that hunts.

F = -(cosine cos(w t) + sine sin(w t)) N v / |v|, w = 2 pi frequency, t since the command, N the load on the table.
Source: Coulomb friction under a load that oscillates; only a phase that is the same in each episode can be found.
"""

from __future__ import annotations

from compass_ros.simulation.effects.effect import Context, Effect, Quantity, friction
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.types import Floats


def _forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
    return friction(Kind.PULSATING, context, numbers[:, :2], numbers[:, 2:])


EFFECT = Effect(
    name="pulsating_lift",
    channel="dynamics",
    quantities=(
        Quantity("cosine", "1", -0.1, 0.1, 0.01),
        Quantity("sine", "1", -0.1, 0.1, 0.01),
        Quantity("frequency", "Hz", 0.2, 6.0, 0.3, amplitude=False, start=1.0),
    ),
    sentence="a pulsation of the lift",
    on=("table",),
    forces=_forces,
)

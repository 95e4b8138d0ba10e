"""A push across the motion, as on a spinning body.

F = m rate (-v_y, v_x), for a spin that stays the same over an episode; on a body in space F = m coefficient w x v, w
its own spin, or F = m (rate_x, rate_y, rate_z) x v where its orientation is not measured and nobody knows how it spins:
no two throws have the same spin, so these are other numbers in each episode.
Source: Magnus force, proportional to spin times speed (Kutta-Joukowski); `rate` holds spin and air density.
"""

from __future__ import annotations

import numpy as np

from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.simulation.extents import BodySize
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.simulation.site_kinds import PLANAR
from compass_ros.simulation.sizes import LARGEST, MODEST
from compass_ros.types import Floats


def _forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
    """Of a body in space: a share of its own spin, then three rates beside."""
    if numbers.shape[1] == len("xyz"):
        numbers = np.pad(numbers, ((0, 0), (1, 0)))
    return tuple(Term(Kind.MAGNUS, site, numbers) for site in context.sites)


def _on_body(size: BodySize) -> tuple[Quantity, ...]:
    if not size.turns:
        rate = size.acceleration / size.speed
        most, modest = LARGEST * rate, MODEST * rate
        return tuple(Quantity(f"rate_{axis}", "1/s", -most, most, modest, chance=True) for axis in "xyz")
    most = size.acceleration / (size.spin * size.speed)
    return (Quantity("coefficient", "1", -LARGEST * most, LARGEST * most, MODEST * most),)


EFFECT = Effect(
    name="magnus",
    channel="dynamics",
    quantities=(Quantity("rate", "1/s", -2.0, 2.0, 0.05),),
    sentence="a push across the motion (Magnus force)",
    on=(*PLANAR, "body"),
    forces=_forces,
    on_body=_on_body,
)

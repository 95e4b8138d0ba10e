"""A centre of mass beside the centre that the tracker sees.

The body's inertial frame moves by (x, y) in the body's frame. Source: rigid-body dynamics (MuJoCo's body_ipos).
"""

from __future__ import annotations

import mujoco

from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.types import Floats


def _model(model: mujoco.MjModel, numbers: Floats, context: Context) -> None:
    for name in context.objects:
        model.body_ipos[model.body(name).id, :2] += numbers


EFFECT = Effect(
    name="off_centre_mass",
    channel="contact",
    quantities=(Quantity("x", "m", -0.008, 0.008, 0.001), Quantity("y", "m", -0.008, 0.008, 0.001)),
    sentence="a centre of mass beside the centre",
    model=_model,
)

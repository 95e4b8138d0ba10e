"""Another model of contact friction: MuJoCo's pyramid instead of its elliptic cone, or the reverse.

cone = the other one where other >= 0.5: a choice, not a number. Source: MuJoCo documentation, "Computation".
"""

from __future__ import annotations

import mujoco

from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.types import Floats


def _model(model: mujoco.MjModel, numbers: Floats, context: Context) -> None:
    if numbers[0] >= 0.5:
        model.opt.cone = 1 - model.opt.cone


EFFECT = Effect(
    name="friction_cone",
    channel="contact",
    quantities=(Quantity("other", "1", 0.0, 1.0, 1.0),),
    sentence="the other friction cone in contacts",
    on=("contacts",),
    model=_model,
)

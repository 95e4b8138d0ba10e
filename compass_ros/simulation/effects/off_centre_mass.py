"""A centre of mass beside the centre that the tracker sees.

The body's inertial frame moves by (x, y) in the body's frame. Source: rigid-body dynamics (MuJoCo's body_ipos).
"""

from __future__ import annotations

import mujoco

from compass_ros.errors import ConfigError
from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.types import Floats


def _model(model: mujoco.MjModel, numbers: Floats, context: Context) -> None:
    for name in context.objects:
        body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name)
        if body < 0:
            raise ConfigError(f"off_centre_mass acts on bodies, '{name}' is a joint")
        if model.body_simple[body] and numbers.any():
            raise ConfigError(
                f"off_centre_mass cannot act on '{name}': MuJoCo has compiled it as centred for good; "
                "give it an <inertial> some micrometres off the centre"
            )
        model.body_ipos[body, :2] += numbers
        model.body_sameframe[body] = mujoco.mjtSameFrame.mjSAMEFRAME_NONE


EFFECT = Effect(
    name="off_centre_mass",
    channel="contact",
    quantities=(Quantity("x", "m", -0.008, 0.008, 0.001), Quantity("y", "m", -0.008, 0.008, 0.001)),
    sentence="a centre of mass beside the centre",
    model=_model,
)

"""One wall that stands elsewhere or is softer than the others.

The geom moves by `offset`, a wall away from the table, a bar along its thinner side (against its own axis); the
stiffness of its contacts, k, turns into k exp(softness). Source: geometry and the direct solref format of MuJoCo.
"""

from __future__ import annotations

import mujoco
import numpy as np

from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.types import Floats


def _model(model: mujoco.MjModel, numbers: Floats, context: Context) -> None:
    offset, softness = numbers
    geom = model.geom(context.sites[0].name).id
    axes = np.zeros(9)
    mujoco.mju_quat2Mat(axes, model.geom_quat[geom])
    plane = model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_PLANE
    inwards = axes.reshape(3, 3)[:, 2 if plane else int(np.argmin(model.geom_size[geom, :2]))]
    model.geom_pos[geom] -= offset * inwards
    model.geom_sameframe[geom] = mujoco.mjtSameFrame.mjSAMEFRAME_NONE
    pairs = (model.pair_geom1 == geom) | (model.pair_geom2 == geom)
    model.pair_solref[pairs, 0] *= np.exp(softness)


EFFECT = Effect(
    name="local_wall",
    channel="contact",
    quantities=(Quantity("offset", "m", -0.03, 0.03, 0.002), Quantity("softness", "1", -2.5, 1.0, 0.2)),
    sentence="that one wall stands elsewhere or is softer",
    on=("wall",),
    model=_model,
)

"""A centre of mass beside the centre that the tracker sees.

The body's inertial frame moves by (x, y) in the body's frame, because a lump lies `arm` beyond the new centre of mass:
inertia grows by m |(x, y)| arm about every axis across that line.
Source: rigid-body dynamics, parallel axes (MuJoCo's body_ipos and body_inertia; products of inertia stay as they are).
"""

from __future__ import annotations

import mujoco
import numpy as np

from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.simulation.site_kinds import PLANAR
from compass_ros.simulation.sites import Site
from compass_ros.types import Floats


def _model(model: mujoco.MjModel, numbers: Floats, context: Context) -> None:
    shift = np.array([*numbers[:2], 0.0])
    for site in context.sites:
        body = model.body(site.name).id
        model.body_ipos[body] += shift
        model.body_inertia[body] += model.body_mass[body] * numbers[2] * _across(shift, model.body_iquat[body])
        model.body_sameframe[body] = mujoco.mjtSameFrame.mjSAMEFRAME_NONE


def _unable(model: mujoco.MjModel, site: Site) -> str:
    if not model.body_simple[model.body(site.name).id]:
        return ""
    return "MuJoCo has compiled it as centred for good; give it an <inertial> some micrometres off the centre"


def _across(shift: Floats, frame: Floats) -> Floats:
    """(3,) |shift| times the squared sine between it and each axis of a (4,) quaternion's frame [m]."""
    length = float(np.linalg.norm(shift))
    inverse, along = np.zeros(4), np.zeros(3)
    mujoco.mju_negQuat(inverse, frame)
    mujoco.mju_rotVecQuat(along, shift / max(length, 1e-12), inverse)
    return np.asarray(length * (1 - along**2))


EFFECT = Effect(
    name="off_centre_mass",
    channel="contact",
    quantities=(
        Quantity("x", "m", -0.008, 0.008, 0.001),
        Quantity("y", "m", -0.008, 0.008, 0.001),
        Quantity("arm", "m", 0.0, 0.05, 0.01, amplitude=False, start=0.01),
    ),
    sentence="a centre of mass beside the centre",
    on=PLANAR,
    model=_model,
    unable=_unable,
)

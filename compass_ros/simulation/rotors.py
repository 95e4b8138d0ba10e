"""Drives that act on a motor's side of a joint, for the laws between the two."""

from __future__ import annotations

import mujoco
import numpy as np

from compass_ros.cells.rotors import PREFIX, anchors, rotors
from compass_ros.errors import ConfigError
from compass_ros.simulation.sites import OF_JOINT, Site
from compass_ros.types import Floats


def onto_rotor(model: mujoco.MjModel, joint: str, inertia: float, share: float) -> tuple[int, float]:
    """Let what drives a joint, and what measures its effort, act on its rotor. Returns the tendon, and its inertia.

    The rotor is a part of the joint's armature, which stood for it: at most all of it, so that what is rigid moves as
    before; where the drawing has none, it is one of its own. `share` of the joint's damping and dry friction is the
    rotor's. A second call sets them anew. Raises ConfigError where the scene has no such rotor.
    """
    tendon = int(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_TENDON, f"{PREFIX}{joint}"))
    if tendon < 0:
        raise ConfigError(f"the scene has no rotor behind joint '{joint}'; simulate its cell, or write the scene anew")
    own, rotor = model.joint(joint).id, model.joint(f"{PREFIX}{joint}").id
    model.actuator_trnid[_driving(model, own), 0] = rotor
    efforts = (model.sensor_type == mujoco.mjtSensor.mjSENS_JOINTACTFRC) & (model.sensor_objid == own)
    model.sensor_objid[efforts] = rotor
    one, other = (int(model.jnt_dofadr[j]) for j in (own, rotor))
    whole = float(model.dof_armature[one] + model.dof_armature[other])
    if whole > 0:
        inertia = min(inertia, whole)
    model.dof_armature[other] = inertia
    model.dof_armature[one] = max(whole - inertia, 0.0)
    for lost in (model.dof_damping, model.dof_frictionloss):
        whole = lost[one] + lost[other]
        lost[one], lost[other] = (1 - share) * whole, share * whole
    return tendon, inertia


def rotorless(model: mujoco.MjModel, site: Site) -> str:
    """Why a joint has no motor's side; empty: it has one, be it without current, for an armature is a rotor's."""
    has = actuated(model, site.name) or model.joint(site.name).armature[0] > 0
    return "" if has else "nothing drives it, and it has no rotor (armature)"


def actuated(model: mujoco.MjModel, joint: str) -> bool:
    """Whether an actuator acts on a joint itself: on its motor's side, where it has one."""
    return bool(_driving(model, model.joint(joint).id))


def _driving(model: mujoco.MjModel, joint: int) -> list[int]:
    """Actuators that act on a joint itself."""
    return [i for i in range(model.nu) if model.actuator_trntype[i] in OF_JOINT and model.actuator_trnid[i, 0] == joint]


def relax(model: mujoco.MjModel, positions: Floats) -> None:
    """Put the anchors of (..., nq) positions where no spring of a dry friction is bent, in place: a motion of some
    milliradians bends it."""
    for joint, anchor in anchors(model):
        positions[..., model.jnt_qposadr[anchor]] = positions[..., model.jnt_qposadr[joint]]


def carry(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Put the rotors where what is between them and their joints carries what the joints hold at rest, in place.

    A spring is twisted by what gravity, motion and other forces ask; play is at the flank that carries it, or, where
    dry friction can hold the joint against a smaller load, between the two. Without a motor a rotor carries nothing:
    what holds such a joint before it is let go, a hand, holds the link.
    """
    of = rotors(model)
    for joint, rotor in of:
        data.qpos[model.jnt_qposadr[rotor]] = data.qpos[model.jnt_qposadr[joint]]
        data.qvel[model.jnt_dofadr[rotor]] = data.qvel[model.jnt_dofadr[joint]]
    mujoco.mj_fwdPosition(model, data)
    mujoco.mj_fwdVelocity(model, data)
    for joint, rotor in of:
        if not _driving(model, rotor):
            continue
        own, other = model.jnt_dofadr[joint], model.jnt_dofadr[rotor]
        tendon = model.tendon(model.joint(rotor).name).id
        load = float(data.qfrc_bias[own] - data.qfrc_passive[own])
        holding = float(model.dof_frictionloss[own] + model.dof_frictionloss[other])
        side = np.clip(load / holding, -1.0, 1.0) if holding > 0 else np.sign(load)
        twist = _twist(load, float(model.tendon_stiffness[tendon]), *model.tendon_actfrcrange[tendon])
        data.qpos[model.jnt_qposadr[rotor]] += model.tendon_lengthspring[tendon, 1] * side + twist


def _twist(load: float, stiffness: float, windup: float, force: float) -> float:
    """Twist x at which a gear carries a load: k x - windup force tanh(k x / force), by Newton's method from beyond,
    where it is convex; 0: it has no spring.

    Twelve steps are exact to 1e-12 for a windup of 0.95.
    """
    if stiffness <= 0:
        return 0.0
    if windup <= 0 or force <= 0:
        return load / stiffness
    x = (load + np.sign(load) * windup * force) / stiffness
    for _ in range(12):
        bent = np.tanh(stiffness * x / force)
        x -= (stiffness * x - windup * force * bent - load) / (stiffness * (1 - windup * (1 - bent**2)))
    return float(x)

"""Drives that act on a motor's side of a joint, for the laws between the two."""

from __future__ import annotations

import mujoco

from compass_ros.cells.rotors import PREFIX
from compass_ros.errors import ConfigError
from compass_ros.simulation.sites import OF_JOINT, Site


def onto_rotor(model: mujoco.MjModel, joint: str, inertia: float, share: float) -> int:
    """Let what drives a joint, and what measures its effort, act on its rotor of that inertia. Returns the tendon.

    The joint's armature, which stood for the rotor, is smaller by that, and `share` of its damping and dry friction
    is the rotor's. A second call sets them anew. Raises ConfigError where the scene has no such rotor.
    """
    tendon = int(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_TENDON, f"{PREFIX}{joint}"))
    if tendon < 0:
        raise ConfigError(f"the scene has no rotor behind joint '{joint}'; simulate its cell, or write the scene anew")
    own, rotor = model.joint(joint).id, model.joint(f"{PREFIX}{joint}").id
    model.actuator_trnid[_driving(model, own), 0] = rotor
    efforts = (model.sensor_type == mujoco.mjtSensor.mjSENS_JOINTACTFRC) & (model.sensor_objid == own)
    model.sensor_objid[efforts] = rotor
    one, other = (int(model.jnt_dofadr[j]) for j in (own, rotor))
    whole = model.dof_armature[one] + model.dof_armature[other]
    model.dof_armature[other] = inertia
    model.dof_armature[one] = max(whole - inertia, 0.0)
    for lost in (model.dof_damping, model.dof_frictionloss):
        whole = lost[one] + lost[other]
        lost[one], lost[other] = (1 - share) * whole, share * whole
    return tendon


def undriven(model: mujoco.MjModel, site: Site) -> str:
    """Why a joint has no motor's side; empty: it has one."""
    return "" if _driving(model, model.joint(site.name).id) else "nothing drives it"


def _driving(model: mujoco.MjModel, joint: int) -> list[int]:
    """Actuators that act on a joint itself."""
    return [i for i in range(model.nu) if model.actuator_trntype[i] in OF_JOINT and model.actuator_trnid[i, 0] == joint]

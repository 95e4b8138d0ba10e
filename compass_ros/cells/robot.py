"""What a scene says of a robot, for whoever matches recordings to it: joints, drives, links, what each joint moves."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import mujoco
import numpy as np

from compass_ros.cells.fields import names
from compass_ros.cells.inertia import mass_diagonal
from compass_ros.cells.scene_source import scene_source
from compass_ros.errors import ConfigError
from compass_ros.types import Floats

Drive = Literal["position", "velocity", "effort", ""]
"""What an actuator is told; empty: there is none, or one that is told something else."""
_OBJECT, _JOINT = mujoco.mjtObj, mujoco.mjtJoint
_ONE = {int(_JOINT.mjJNT_HINGE), int(_JOINT.mjJNT_SLIDE)}


@dataclass(frozen=True)
class Joint:
    """A hinge or slide."""

    name: str
    slide: bool
    damping: float
    frictionloss: float
    armature: float
    body: str
    actuator: str = ""
    drive: Drive = ""
    gain: float = 0.0
    """What the actuator's leading number is: stiffness, damping, or force for a command of 1 (with the gear)."""
    servo_damping: float = 0.0
    most: float = np.inf
    """Largest force of the drive [N m or N]."""


@dataclass(frozen=True)
class Link:
    """A body that moves."""

    name: str
    mass: float
    largest_inertia: float
    free: bool
    """Whether it floats: nothing but its first state says where it is."""


@dataclass(frozen=True)
class Robot:
    """A scene as its document says it."""

    path: Path
    joints: tuple[Joint, ...]
    links: tuple[Link, ...]
    bodies: tuple[str, ...]
    sites: tuple[str, ...]
    remark: str
    """On meshes that are missing."""
    model: mujoco.MjModel

    def joint(self, name: str) -> Joint:
        return next(j for j in self.joints if j.name == name)

    @property
    def coupled(self) -> tuple[str, ...]:
        """Actuators that act on no single joint: on a tendon, a site or a body."""
        own = {joint.actuator for joint in self.joints}
        return tuple(name for name in names(self.model, _OBJECT.mjOBJ_ACTUATOR) if name not in own)


def robot(path: Path) -> Robot:
    """Read a scene, MJCF or URDF. Raises ConfigError in one line."""
    if not path.is_file():
        raise ConfigError(f"{path}: no such model; expected an MJCF or URDF")
    source = scene_source(path)
    try:
        model = source.spec.compile()
    except ValueError as error:
        raise ConfigError(f"{path}: {' '.join(str(error).split())}") from error
    joints = [_joint(model, j) for j in range(model.njnt) if int(model.jnt_type[j]) in _ONE and model.joint(j).name]
    bodies, sites = (tuple(names(model, kind)) for kind in (_OBJECT.mjOBJ_BODY, _OBJECT.mjOBJ_SITE))
    return Robot(path, tuple(joints), tuple(_links(model)), bodies, sites, source.remark, model)


def inertias(robot: Robot, joints: tuple[str, ...], positions: Floats) -> Floats:
    """(J,) what each joint moves [kg m^2 or kg], armature included: the median over (n, J) positions."""
    model, data = robot.model, mujoco.MjData(robot.model)
    qpos = [int(model.joint(name).qposadr[0]) for name in joints]
    dofs = [int(model.joint(name).dofadr[0]) for name in joints]
    found = []
    for row in positions:
        data.qpos[:] = model.qpos0
        data.qpos[qpos] = row
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_makeM(model, data)
        found.append(mass_diagonal(model, data)[dofs])
    return np.asarray(np.median(found, axis=0))


def _joint(model: mujoco.MjModel, joint: int) -> Joint:
    dof, name = int(model.jnt_dofadr[joint]), model.joint(joint).name
    body = model.body(model.jnt_bodyid[joint]).name
    joint_alone = Joint(
        name,
        int(model.jnt_type[joint]) == _JOINT.mjJNT_SLIDE,
        damping=float(model.dof_damping[dof]),
        frictionloss=float(model.dof_frictionloss[dof]),
        armature=float(model.dof_armature[dof]),
        body=body,
    )
    own = [a for a in range(model.nu) if _drives(model, a, joint)]
    if not own:
        return joint_alone
    first, bias = own[0], model.actuator_biasprm[own[0]]
    affine = int(model.actuator_biastype[first]) == mujoco.mjtBias.mjBIAS_AFFINE
    kind: Drive = ("position" if bias[1] else "velocity") if affine and any(bias[1:3]) else "effort"
    gear = float(model.actuator_gear[first, 0]) if kind == "effort" else 1.0
    return replace(
        joint_alone,
        actuator=model.actuator(first).name,
        drive=kind,
        gain=float(model.actuator_gainprm[first, 0]) * gear,
        servo_damping=-float(bias[2]) if affine else 0.0,
        most=float(model.actuator_forcerange[first, 1]) if model.actuator_forcelimited[first] else np.inf,
    )


def _drives(model: mujoco.MjModel, actuator: int, joint: int) -> bool:
    """Whether an actuator with a name acts on a joint, and its force is in proportion to what it is told."""
    fixed = int(model.actuator_gaintype[actuator]) == mujoco.mjtGain.mjGAIN_FIXED
    on = int(model.actuator_trntype[actuator]) in (mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT)
    return fixed and on and int(model.actuator_trnid[actuator, 0]) == joint and bool(model.actuator(actuator).name)


def _links(model: mujoco.MjModel) -> list[Link]:
    out = []
    for body in range(1, model.nbody):
        if model.body(body).name and model.body_weldid[body] and model.body_mass[body] > 1e-6:
            first = int(model.body_jntadr[body])
            free = first >= 0 and int(model.jnt_type[first]) == _JOINT.mjJNT_FREE
            mass, inertia = float(model.body_mass[body]), float(model.body_inertia[body].max())
            out.append(Link(model.body(body).name, mass, inertia, free))
    return out

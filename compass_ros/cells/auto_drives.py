"""Which fields of joints and actuators can be tuned, and how far each may be from what the scene says."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np

from compass_ros.cells.candidate import Candidate, around, times

_JOINT = mujoco.mjtJoint
_ALONG = 0.9
"""Component of a joint's axis above which it says how long the axis is, and not where it points."""


def joint_fields(m: mujoco.MjModel, joint: int) -> Iterator[Candidate]:
    """Friction, damping and inertia of each degree of freedom; spring, limits and place of slides and hinges."""
    name, kind = m.joint(joint).name, int(m.jnt_type[joint])
    dofs = {int(_JOINT.mjJNT_FREE): 6, int(_JOINT.mjJNT_BALL): 3}.get(kind, 1)
    for i in range(dofs):
        dof = int(m.jnt_dofadr[joint]) + i
        linear = kind == _JOINT.mjJNT_SLIDE or (dofs == 6 and i < 3)
        index, word = (f"[{i}]", f"_{i}") if dofs > 1 else ("", "")
        rows = (
            ("joint_damping", "dof_damping", 0.05, "N s/m" if linear else "N m s/rad"),
            ("armature", "dof_armature", 0.02, "kg" if linear else "kg m^2"),
            ("frictionloss", "dof_frictionloss", 0.02, "N" if linear else "N m"),
        )
        for what, field, share, unit in rows:
            value = float(getattr(m, field)[dof])
            yield _from_zero(f"{name}@dyna@{what}{word}", field + index, name, value, share * m.dof_M0[dof], unit)
    if dofs == 1:
        yield from _of_one(m, joint)


def _of_one(m: mujoco.MjModel, joint: int) -> Iterator[Candidate]:
    """What joints with one degree of freedom have besides."""
    name, dof = m.joint(joint).name, int(m.jnt_dofadr[joint])
    inertia, slide = float(m.dof_M0[dof]), int(m.jnt_type[joint]) == _JOINT.mjJNT_SLIDE
    force, length = ("N", "m") if slide else ("N m", "rad")
    stiffness = float(m.jnt_stiffness[joint])
    width = max(0.1 * stiffness, 0.05 * inertia, 1e-9)
    high = stiffness + 10 * width
    yield Candidate(f"{name}@dyna@stiffness", "jnt_stiffness", name, stiffness, 0.0, high, width, f"{force}/{length}")
    for i, power in enumerate((2, 3)):
        bend, drag = float(m.jnt_stiffnesspoly[joint, i]), float(m.dof_dampingpoly[dof, i])
        stem, size = f"{name}@dyna@", 0.05 * inertia
        unit = f"{force}/{length}^{power}"
        yield _from_zero(f"{stem}stiffness_{power}", f"jnt_stiffnesspoly[{i}]", name, bend, size, unit)
        unit = f"{force} s^{power}/{length}^{power}"
        yield _from_zero(f"{stem}joint_damping_{power}", f"dof_dampingpoly[{i}]", name, drag, size, unit)
    if stiffness > 0:
        rest = float(m.qpos_spring[m.jnt_qposadr[joint]])
        yield around(f"{name}@dyna@spring_rest", "qpos_spring", name, rest, 0.1, 0.01, length)
    if m.jnt_limited[joint]:
        for i, side in enumerate(("low", "high")):
            at = float(m.jnt_range[joint, i])
            yield around(f"{name}@shape@limit_{side}", f"jnt_range[{i}]", name, at, 0.05, 0.005, length)
    yield from _place(m, joint, slide)


def _place(m: mujoco.MjModel, joint: int, slide: bool) -> Iterator[Candidate]:
    """Where the axis points, and where a hinge is, across its axis."""
    if m.body_simple[m.jnt_bodyid[joint]]:
        return  # MuJoCo has compiled its inertia as diagonal
    name = m.joint(joint).name
    for i, axis in enumerate("xyz"):
        component = float(m.jnt_axis[joint, i])
        if abs(component) > _ALONG:
            continue
        yield around(f"{name}@pose@axis_{axis}", f"jnt_axis[{i}]", name, component, 0.02, 0.002, "1")
        if not slide:
            place = float(m.jnt_pos[joint, i])
            yield around(f"{name}@pose@{axis}", f"jnt_pos[{i}]", name, place, 0.005, 0.0005, "m")


def actuator_fields(m: mujoco.MjModel, actuator: int) -> Iterator[Candidate]:
    """Gain, command, offset, gear, and what the drive adds in damping and inertia."""
    name, bias = m.actuator(actuator).name, m.actuator_biasprm[actuator]
    gain = float(m.actuator_gainprm[actuator, 0])
    if bias[1] or bias[2]:
        yield times(f"{name}@actuation@servo_gain", "servo_gain", name, gain, 0.5, 0.05, "1")
    yield around(f"{name}@actuation@command_scale", "command_scale", name, 1.0, 0.3, 0.05, "1")
    size = abs(gain) or 1e-6
    offset = float(bias[0])
    yield around(f"{name}@actuation@offset", "actuator_biasprm[0]", name, offset, 0.05 * size, 0.005 * size, "N")
    if m.actuator_trntype[actuator] in (mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT):
        dof = int(m.jnt_dofadr[m.actuator_trnid[actuator, 0]])
        inertia, gear = float(m.dof_M0[dof]), float(m.actuator_gear[actuator, 0])
        yield times(f"{name}@actuation@gear", "actuator_gear[0]", name, gear, 0.3, 0.02, "1")
        for what, share, unit in (("damping", 0.05, "N s/m"), ("armature", 0.02, "kg")):
            value = float(getattr(m, f"actuator_{what}")[actuator])
            yield _from_zero(f"{name}@actuation@{what}", f"actuator_{what}", name, value, share * inertia, unit)
    if m.actuator_forcelimited[actuator]:
        for i, side in enumerate(("low", "high")):
            limit = float(m.actuator_forcerange[actuator, i])
            yield times(f"{name}@actuation@force_{side}", f"actuator_forcerange[{i}]", name, limit, 0.3, 0.05, "N")


def _from_zero(name: str, field: str, of: str, value: float, scale: float, unit: str) -> Candidate:
    """What cannot be negative and is often left out of a scene."""
    width = float(np.max([0.2 * value, scale, 1e-9]))
    return Candidate(name, field, of, value, 0.0, value + 10 * width, width, unit)

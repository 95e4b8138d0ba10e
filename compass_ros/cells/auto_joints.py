"""Which fields of joints can be tuned, and how far each may be from what the scene says."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco

from compass_ros.cells.candidate import Candidate, around, from_zero

_JOINT = mujoco.mjtJoint
_ALONG = 0.9
"""Component of a joint's axis above which it says how long the axis is, and not where it points."""


def joint_fields(m: mujoco.MjModel, joint: int) -> Iterator[Candidate]:
    """Friction, damping and inertia, one number a joint as in MJCF; spring, limits and place of slides and hinges."""
    name, kind, dof = m.joint(joint).name, int(m.jnt_type[joint]), int(m.jnt_dofadr[joint])
    slide, dofs = kind == _JOINT.mjJNT_SLIDE, {int(_JOINT.mjJNT_FREE): 6, int(_JOINT.mjJNT_BALL): 3}.get(kind, 1)
    inertia = float(m.dof_M0[dof : dof + dofs].min())  # of a free body that which turns it
    rows = (
        ("joint_damping", "dof_damping", 0.05, "N s/m" if slide else "N m s/rad"),
        ("armature", "dof_armature", 0.02, "kg" if slide else "kg m^2"),
        ("frictionloss", "dof_frictionloss", 0.02, "N" if slide else "N m"),
    )
    for what, field, share, unit in rows:
        value = float(getattr(m, field)[dof])
        yield from_zero(f"{name}@dyna@{what}", field, name, value, share * inertia, unit)
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
        yield from_zero(f"{stem}stiffness_{power}", f"jnt_stiffnesspoly[{i}]", name, bend, size, unit)
        unit = f"{force} s^{power}/{length}^{power}"
        yield from_zero(f"{stem}joint_damping_{power}", f"dof_dampingpoly[{i}]", name, drag, size, unit)
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

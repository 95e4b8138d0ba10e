"""What lies between a joint and its motor or bearing, as joints of their own: its state is a part of qpos and qvel.

MuJoCo moves a driven joint and its motor as one. A rotor is a body of the world with a joint of the same kind and with
inertia alone, and a tendon whose length is the rotor's angle less the joint's. Nothing drives it, and the tendon does
nothing, until a law says so; what moves otherwise is the same to the last bit.

Dry friction is a spring before it slides. What such a spring is anchored to, and slides under friction, is a slide of
the world; `native/fields.c` moves it. The spring's deflection is the joint's angle or place less the anchor's, and its
largest at rest is the anchor's range (`jnt_range`): 0 is friction without a spring. Three anchors share a body, along
axes that are perpendicular, so that none moves another: a body costs a step more than a joint does.
"""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np

from compass_ros.cells.cell import Beside

PREFIX = "rotor/"
ANCHOR = "anchor/"
_ONE_DOF = (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE)
_DUST_KG, _DUST_KG_M2 = 1e-9, 1e-12
"""What a rotor that nothing drives weighs; MuJoCo has no body without mass."""
_AXES = np.eye(3)
"""Of the anchors of a body."""


def add_beside(spec: mujoco.MjSpec, beside: Beside) -> None:
    """Add rotors, then anchors, after all that there is."""
    add_rotors(spec, beside[0])
    add_anchors(spec, beside[1])


def add_rotors(spec: mujoco.MjSpec, joints: Sequence[str]) -> None:
    """Add a rotor to each of some hinges and slides, after all that there is."""
    for name in joints:
        joint = spec.joint(name)
        rotor = _dust(spec, f"{PREFIX}{name}").add_joint(name=f"{PREFIX}{name}", type=joint.type, axis=[0, 0, 1])
        rotor.actfrclimited, rotor.actfrcrange = joint.actfrclimited, joint.actfrcrange
        rotor.solref_friction, rotor.solimp_friction = joint.solref_friction, joint.solimp_friction
        tendon = spec.add_tendon(name=f"{PREFIX}{name}")
        tendon.springlength = [0.0, 0.0]
        tendon.wrap_joint(rotor.name, 1.0)
        tendon.wrap_joint(name, -1.0)


def add_anchors(spec: mujoco.MjSpec, joints: Sequence[str]) -> None:
    """Add an anchor to those of some joints and bodies that are hinges or slides, after all that there is."""
    found = [joint for joint in map(spec.joint, joints) if joint is not None and joint.type in _ONE_DOF]
    for first in range(0, len(found), len(_AXES)):
        body = _dust(spec, f"{ANCHOR}{found[first].name}")
        body.gravcomp = 1.0  # where nothing carries it, it stays where it is
        for joint, axis in zip(found[first:], _AXES, strict=False):
            body.add_joint(name=f"{ANCHOR}{joint.name}", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)


def _dust(spec: mujoco.MjSpec, name: str) -> mujoco.MjsBody:
    body = spec.worldbody.add_body(name=name)
    body.mass, body.inertia, body.explicitinertial = _DUST_KG, [_DUST_KG_M2] * 3, True
    return body


def rotors(model: mujoco.MjModel) -> list[tuple[int, int]]:
    """(joint, rotor) of each rotor in a model, as ids of joints."""
    return _pairs(model, PREFIX)


def anchors(model: mujoco.MjModel) -> list[tuple[int, int]]:
    """(joint, anchor) of each anchor in a model, as ids of joints."""
    return _pairs(model, ANCHOR)


def _pairs(model: mujoco.MjModel, prefix: str) -> list[tuple[int, int]]:
    names = [model.joint(i).name for i in range(model.njnt)]
    return [(names.index(name.removeprefix(prefix)), i) for i, name in enumerate(names) if name.startswith(prefix)]

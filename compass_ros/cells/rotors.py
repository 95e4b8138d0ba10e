"""A motor's side of a joint, as a joint of its own: what is elastic or has play is between the two.

MuJoCo moves a driven joint and its motor as one. A rotor is a body of the world with a joint of the same kind and with
inertia alone, and a tendon whose length is the rotor's angle less the joint's. Nothing drives it, and the tendon does
nothing, until a law says so; what moves otherwise is the same to the last bit. Its state is a part of qpos and qvel.
"""

from __future__ import annotations

from collections.abc import Sequence

import mujoco

PREFIX = "rotor/"
_DUST_KG, _DUST_KG_M2 = 1e-9, 1e-12
"""What a rotor that nothing drives weighs; MuJoCo has no body without mass."""


def add_rotors(spec: mujoco.MjSpec, joints: Sequence[str]) -> None:
    """Add a rotor to each of some hinges and slides, after all that there is."""
    for name in joints:
        joint = spec.joint(name)
        body = spec.worldbody.add_body(name=f"{PREFIX}{name}")
        body.mass, body.inertia, body.explicitinertial = _DUST_KG, [_DUST_KG_M2] * 3, True
        rotor = body.add_joint(name=f"{PREFIX}{name}", type=joint.type, axis=[0, 0, 1])
        rotor.actfrclimited, rotor.actfrcrange = joint.actfrclimited, joint.actfrcrange
        rotor.solref_friction, rotor.solimp_friction = joint.solref_friction, joint.solimp_friction
        tendon = spec.add_tendon(name=f"{PREFIX}{name}")
        tendon.springlength = [0.0, 0.0]
        tendon.wrap_joint(rotor.name, 1.0)
        tendon.wrap_joint(name, -1.0)


def rotors(model: mujoco.MjModel) -> list[tuple[int, int]]:
    """(joint, rotor) of each rotor in a model, as ids of joints."""
    names = [model.joint(i).name for i in range(model.njnt)]
    return [(names.index(name.removeprefix(PREFIX)), i) for i, name in enumerate(names) if name.startswith(PREFIX)]

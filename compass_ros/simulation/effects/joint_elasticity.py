"""A gear or belt that gives way between a motor and its joint.

tau = (theta - q) / compliance + damping (theta' - q') on the joint and its opposite on the motor, theta the motor's
angle behind the gear, rotor theta'' = drive - tau; damping = 2 x 0.05 sqrt(rotor / compliance). Zero compliance is
absent: motor and joint are one. `rotor` is a part of the joint's armature, as far as it has one; `share` of the joint's
damping and dry friction is the motor's.
Source: Spong 1987, flexible-joint robots; 0.05 of critical damping is usual in geared and belt drives (Albu-Schaeffer,
Ott and Hirzinger 2007). In MuJoCo: a second joint, and a tendon with stiffness between them.
"""

from __future__ import annotations

import mujoco
import numpy as np

from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.simulation.rotors import onto_rotor, undriven
from compass_ros.simulation.sites import JOINTS
from compass_ros.simulation.sizes import LARGEST, MODEST, JointSize, unit_joint
from compass_ros.types import Floats

_DAMPING_RATIO = 0.05
_SOFTEST = 0.25
"""The step times the highest frequency of the motor on its spring, in which MuJoCo's integrator is still right: what is
stiffer is taken for so stiff. Semi-implicit steps are stable below 2 and 0.3 % off in frequency here. The implicit ones
leave out damping between two trees of bodies, as if either side were heavier by damping x step: here 2.5 % of the
rotor, and less for what is softer."""


def _model(model: mujoco.MjModel, numbers: Floats, context: Context) -> None:
    compliance, rotor, share = numbers
    if compliance <= 0:
        return
    for site in context.sites:
        tendon = onto_rotor(model, site.name, rotor, share)
        stiffness = min(1 / compliance, rotor * (_SOFTEST / model.opt.timestep) ** 2)
        model.tendon_stiffness[tendon] = stiffness
        model.tendon_damping[tendon] = 2 * _DAMPING_RATIO * np.sqrt(rotor * stiffness)
        model.tendon_limited[tendon] = 0


def _on_joint(size: JointSize) -> tuple[Quantity, ...]:
    """What gives way by the whole travel under the joint's own force would be no gear."""
    most = size.spread / size.force
    return (
        Quantity("compliance", f"{size.length_unit}/{size.force_unit}", 0.0, LARGEST * most, MODEST * most),
        *rotor_of(size),
    )


def rotor_of(size: JointSize) -> tuple[Quantity, Quantity]:
    """The motor's inertia behind its gear: most drives are built so that it is like that of what they move. And how
    much of the joint's damping and dry friction is the motor's: most of it, of a geared drive (Nordin and Gutman 2002
    have some on either side)."""
    unit = "kg m^2" if size.kind == "hinge" else "kg"
    own = size.inertia
    rotor = Quantity("rotor", unit, 0.01 * own, 3.0 * own, 0.1 * own, amplitude=False, start=0.3 * own)
    return rotor, Quantity("share", "1", 0.0, 1.0, 0.1, amplitude=False, start=0.8)


EFFECT = Effect(
    name="joint_elasticity",
    channel="dynamics",
    quantities=_on_joint(unit_joint("hinge")),
    sentence="a gear or belt that gives way",
    on=JOINTS,
    model=_model,
    on_joint=_on_joint,
    unable=undriven,
    rotor=True,
    by_name=True,
)

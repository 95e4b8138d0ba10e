"""A gear or belt that gives way between a motor and its joint.

tau = k x - windup F tanh(k x / F) + h sign(x') + damping x' on the joint and its opposite on the motor: x = theta - q
is the twist, theta the motor's angle behind the gear, k = 1 / compliance, F = `windup_force`, h = `hysteresis`, rotor
theta'' = drive - tau, damping = 2 x 0.05 sqrt(rotor k). It is softer by a share `windup` about no twist, up to F, and
loses what dry friction within it does. Zero compliance is absent: motor and joint are one. `rotor` is a part of the
joint's armature, where the drawing has one; `share` of the joint's damping and dry friction is the motor's. An episode
begins with the spring as the joint's load at rest twists it, where a motor bears that.
Source: Spong 1987, flexible-joint robots; 0.05 of critical damping is usual in geared and belt drives (Albu-Schaeffer,
Ott and Hirzinger 2007); wind-up that is soft and hysteresis are what harmonic drives show (Tuttle and Seering 1996;
Taghirad and Belanger 1998). In MuJoCo: a second joint, and a tendon with stiffness, damping and frictionloss between
them; the wind-up is a force of `native/fields.c`.
"""

from __future__ import annotations

import mujoco
import numpy as np

from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.simulation.rotors import onto_rotor, rotorless
from compass_ros.simulation.site_kinds import JOINTS
from compass_ros.simulation.sizes import LARGEST, MODEST, JointSize, unit_joint
from compass_ros.types import Floats

_DAMPING_RATIO = 0.05
_FASTEST = 0.5
"""The step times the frequency of the motor on its spring, up to which a spring is stiffer: what is stiffer yet is
taken for so stiff. Semi-implicit steps are stable while that of motor and joint together is below 2, so with a rotor
that is up to 15 times as heavy as its joint; here the spring bends under a load as it should, and the motor's swing is
1 % too fast, at 0.5 / (2 pi step) = 40 Hz of 2 ms. The implicit ones leave out damping between two trees of bodies, as
if either side were heavier by damping x step: here 5 % of the rotor, and less for what is softer."""


def _model(model: mujoco.MjModel, numbers: Floats, context: Context) -> None:
    compliance, rotor, share, windup, windup_force, hysteresis = numbers
    if compliance <= 0:
        return
    for site in context.sites:
        tendon, inertia = onto_rotor(model, site.name, rotor, share)
        stiffness = min(1 / compliance, inertia * (_FASTEST / model.opt.timestep) ** 2)
        model.tendon_stiffness[tendon] = stiffness
        model.tendon_actfrcrange[tendon] = windup, windup_force  # not limited: they mean nothing to MuJoCo
        model.tendon_damping[tendon] = 2 * _DAMPING_RATIO * np.sqrt(inertia * stiffness)
        model.tendon_limited[tendon] = 0
        model.tendon_frictionloss[tendon] = hysteresis


def _forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
    if not numbers[:, 3].any():
        return ()
    return tuple(Term(Kind.WINDUP, site, numbers[:, :0]) for site in context.sites)  # the model has its numbers


def _on_joint(size: JointSize) -> tuple[Quantity, ...]:
    """What gives way by the whole travel under the joint's own force would be no gear, nor one that is no stiffer about
    no twist than a twentieth of what it is. Where a search begins matters little: fits that began at windups of 0.1 to
    0.69 and forces of 0.06 to 0.24 of the joint's ended at mean squares of 1.153 to 1.159 (`two_joint_arm` 1000001)."""
    most, force, unit = size.spread / size.force, size.force, size.force_unit
    return (
        Quantity("compliance", f"{size.length_unit}/{unit}", 0.0, LARGEST * most, MODEST * most),
        *rotor_of(size),
        Quantity("windup", "1", 0.0, 0.95, 0.1, amplitude=False, start=0.3, later=True),
        Quantity(
            "windup_force", unit, 0.01 * force, force, 0.1 * force, amplitude=False, start=0.2 * force, later=True
        ),
        Quantity("hysteresis", unit, 0.0, LARGEST * force, MODEST * force, amplitude=False, later=True),
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
    forces=_forces,
    model=_model,
    on_joint=_on_joint,
    unable=rotorless,
    rotor=True,
    by_name=True,
)

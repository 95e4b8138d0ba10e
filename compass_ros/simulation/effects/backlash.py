"""Play between a motor and its joint.

tau = 0 while |theta - q| < play / 2, and beyond whatever keeps it from being more, without bouncing; theta the motor's
angle behind the gear, rotor theta'' = drive - tau. Zero play is absent: motor and joint are one. `rotor` is a part of
the joint's armature, where the drawing has one, and `share` of its damping and dry friction is the motor's. An episode
begins at the flank that carries the joint's load at rest, where a motor bears that; where dry friction can hold it, or
there is no motor, between the two.
Source: Nordin and Gutman 2002, dead-zone model with stiff flanks. In MuJoCo: a second joint, and a tendon with limits
between them; with an elasticity beside it, a spring with a dead band.
"""

from __future__ import annotations

import mujoco

from compass_ros.simulation.effects.effect import Context, Effect, Quantity
from compass_ros.simulation.effects.joint_elasticity import rotor_of
from compass_ros.simulation.rotors import onto_rotor, rotorless
from compass_ros.simulation.site_kinds import JOINTS
from compass_ros.simulation.sizes import LARGEST, MODEST, JointSize, unit_joint
from compass_ros.types import Floats

_STIFF_STEPS = 2.0
"""Time constant of the flanks in time steps: the stiffest that MuJoCo's constraints stand."""


def _model(model: mujoco.MjModel, numbers: Floats, context: Context) -> None:
    play, rotor, share = numbers
    if play <= 0:
        return
    for site in context.sites:
        tendon, _ = onto_rotor(model, site.name, rotor, share)
        model.tendon_lengthspring[tendon] = model.tendon_range[tendon] = (-0.5 * play, 0.5 * play)
        model.tendon_solref_lim[tendon] = (_STIFF_STEPS * model.opt.timestep, 1.0)
        model.tendon_limited[tendon] = model.tendon_stiffness[tendon] == 0


def _on_joint(size: JointSize) -> tuple[Quantity, ...]:
    play = Quantity("play", size.length_unit, 0.0, LARGEST * size.spread, MODEST * size.spread)
    return (play, *rotor_of(size))


EFFECT = Effect(
    name="backlash",
    channel="dynamics",
    quantities=_on_joint(unit_joint("hinge")),
    sentence="play between the drive and its joint",
    on=JOINTS,
    model=_model,
    on_joint=_on_joint,
    unable=rotorless,
    rotor=True,
    by_name=True,
)

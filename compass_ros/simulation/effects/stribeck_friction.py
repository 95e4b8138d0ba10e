"""Friction that is higher when slow.

F = -extra exp(-(v / speed)^2) N v / |v| on top of the ordinary friction; on a joint `extra` is a torque [N m].
Source: Stribeck curve in the form of Armstrong-Helouvry 1994, Gaussian exponent 2. The speeds of contacts are below
0.1 m/s there; with more than 0.3 m/s it is no friction of low speeds: a drag that falls at speed looks like that.
On a joint it may be a spring before it slides, together with the joint's own dry friction Fc: F = -k z - c z', k =
(Fc + extra) / presliding, c = 2 x 0.05 sqrt(k M), z' = v - |v| z / z(v), z(v) = (Fc + extra exp(-(v / speed)^2)) / k, M
the joint's own inertia. Presliding 0: it holds, as rigid as can be; extra 0: the joint's own friction is a spring.
Source: Dahl 1968 and LuGre friction as in Olsson's thesis of 1996, damped like the springs of joint_elasticity;
presliding of gears is some milliradians (Armstrong-Helouvry, Dupont and Canudas de Wit 1994), and beyond 1 % of what a
joint moves it is none any more.
On a body in space the coefficient of each of its contacts with what stands is larger by extra exp(-(v / speed)^2), v
the slip there; with `extra` below zero it grows with speed.
"""

from __future__ import annotations

import mujoco

from compass_ros.cells.rotors import ANCHOR
from compass_ros.errors import ConfigError
from compass_ros.simulation.contacts import slides_on_what_stands
from compass_ros.simulation.effects.effect import Context, Effect, Quantity, friction
from compass_ros.simulation.extents import BodySize
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.simulation.site_kinds import JOINTS, LYING
from compass_ros.simulation.sizes import LARGEST, MODEST, JointSize
from compass_ros.types import Floats

_LONGEST = 0.01
"""Presliding, at most, as a share of what a joint moves."""


def _forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
    return friction(Kind.STRIBECK, context, numbers[:, :1], numbers[:, 1:2])


def _model(model: mujoco.MjModel, numbers: Floats, context: Context) -> None:
    """How far a joint bends its friction's spring. Raises ConfigError where the scene lacks the spring's anchor."""
    if not numbers[2:].any():
        return  # rigid, or the numbers of a body, which are two
    for site in context.sites:
        anchor = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, f"{ANCHOR}{site.name}")
        if anchor < 0:
            raise ConfigError(
                f"the scene has no anchor for joint '{site.name}'; simulate its cell, or write the scene anew"
            )
        model.jnt_range[anchor, 1] = numbers[2]


def _on_joint(size: JointSize) -> tuple[Quantity, ...]:
    """At a speed beyond the fastest that was seen the friction would hardly fall: it is dry friction then."""
    v, most = size.fastest, _LONGEST * size.spread
    return (
        Quantity("extra", size.force_unit, 0.0, LARGEST * size.force, MODEST * size.force),
        Quantity("speed", f"{size.length_unit}/s", 0.01 * v, v, 0.1 * v, amplitude=False, start=0.2 * v),
        Quantity("presliding", size.length_unit, 0.0, most, 0.1 * most, later=True),
    )


def _on_body(size: BodySize) -> tuple[Quantity, ...]:
    v = size.fastest
    return (
        Quantity("extra", "1", -0.5, 1.0, 0.02),
        Quantity("speed", "m/s", 0.01 * v, v, 0.1 * v, amplitude=False, start=0.2 * v),
    )


EFFECT = Effect(
    name="stribeck_friction",
    channel="dynamics",
    quantities=(
        Quantity("extra", "1", 0.0, 0.5, 0.02),
        Quantity("speed", "m/s", 0.01, 1.0, 0.05, amplitude=False, start=0.1),
    ),
    sentence="higher friction at low speed (Stribeck)",
    on=(*LYING, *JOINTS, "body"),
    forces=_forces,
    model=_model,
    on_joint=_on_joint,
    on_body=_on_body,
    unable=slides_on_what_stands,
    spring="presliding",
)

"""An arm as numbers: the chain of its links, what belongs to each coordinate, its servos."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from compass_ros.errors import ConfigError
from compass_ros.types import Floats, Ints
from compass_ros.worlds.arms.chain import mass_matrix

GRAVITY = 9.81
"""Of MuJoCo's default option [m/s^2]."""
IMPEDANCE, TIME_S, WIDEST = 0.9, 0.02, 0.95
"""MuJoCo's defaults for `frictionloss` (solimp[0], solref[0], solimp[1]): its documentation, Computation,
parameters."""
LOCKED, LOCK_RATE = 0.999, 800.0
"""The same two numbers of a joint that really locks: it creeps a thousandth as fast, and stops within 2 ms."""


@dataclass(frozen=True)
class Arm:
    """N coordinates: n hinges of the chain (those of a loose base, then the J joints), then rotors of elastic
    gears."""

    joints: tuple[str, ...]
    """(J,) names."""
    bodies: tuple[str, ...]
    """(J,) of the link that each joint moves."""
    origin: Floats
    """(n, 3) of each link in the one before, at angle zero [m]."""
    turn: Floats
    """(n, 3, 3) rotation of the same."""
    axis: Floats
    """(n, 3) unit, in the link."""
    mass: Floats
    """(n,) [kg]"""
    centre: Floats
    """(n, 3) of mass, in the link [m]."""
    inertia: Floats
    """(n, 3, 3) about the centre, in the link's axes [kg m^2]."""
    gravity: Floats
    """(3,) [m/s^2]"""
    armature: Floats
    """(N,) [kg m^2]"""
    damping: Floats
    """(N,) [N m s/rad]"""
    dry: Floats
    """(N,) dry friction [N m]."""
    soft: Floats
    """(N,) see `chain.accelerate` [rad/s^2 per N m]."""
    back: Floats
    """(N,) the same [1/s]."""
    hinge: Ints
    """(J,) coordinate of each joint."""
    motor: Ints
    """(J,) coordinate that its drive turns: the joint itself, or its rotor."""
    zero: Floats
    """(J,) what the encoder shows at angle zero [rad]."""
    stiffness: Floats
    """(J,) of its servo [N m/rad]; zero: it has none."""
    damper: Floats
    """(J,) of its servo [N m s/rad]."""
    limit: Floats
    """(J,) of its drive's torque [N m]."""
    delay: float = 0.0
    """From a command to the servo [s]."""

    @property
    def chain(self) -> tuple[Floats, Floats, Floats, Floats, Floats, Floats]:
        """What the compiled functions take of the links."""
        return self.origin, self.turn, self.axis, self.mass, self.centre, self.inertia

    def link(self, body: str) -> int:
        """Place of a body in the chain."""
        return int(self.hinge[self.bodies.index(body)])

    def locking(self, joints: Ints) -> Arm:
        """With dry friction that holds these joints (indices) where they stand."""
        soft, back = self.soft.copy(), self.back.copy()
        at = self.motor[joints]
        soft[at] *= (1 - LOCKED) / LOCKED * IMPEDANCE / (1 - IMPEDANCE)
        back[at] = LOCK_RATE
        return replace(self, soft=soft, back=back)


def softness(arm: Arm) -> tuple[Floats, Floats]:
    """(N,) regularisation and rate of dry friction as a scene's default has them, from the arm at angle zero.

    MuJoCo's documentation, Computation: R = (1 - d) / d times the diagonal of the inverse mass matrix in the
    reference configuration, and a reference acceleration of -2 v / (d_width * timeconst).
    """
    inverse = np.linalg.inv(mass_matrix(np.zeros(len(arm.mass)), arm.armature, *arm.chain))
    soft = (1 - IMPEDANCE) / IMPEDANCE * np.diag(inverse)
    return soft, np.full(len(soft), 2 / (WIDEST * TIME_S))


def with_values(arm: Arm, values: Mapping[str, float]) -> Arm:
    """The arm at values of the cell's parameters, `object@type@field`.

    Raises ConfigError for one whose meaning is not known here.
    """
    armature, damping, dry, zero = (a.copy() for a in (arm.armature, arm.damping, arm.dry, arm.zero))
    mass, centre, inertia = arm.mass.copy(), arm.centre.copy(), arm.inertia.copy()
    stiffness, delay = arm.stiffness.copy(), arm.delay
    for name, value in values.items():
        thing, _, what = name.partition("@")
        if what == "actuation@delay":
            delay = value
        elif thing in arm.joints and what == "actuation@gain":
            stiffness[arm.joints.index(thing)] = value
        elif thing in arm.joints and what == "sensing@zero":
            zero[arm.joints.index(thing)] = value
        elif thing in arm.joints and what in ("dyna@armature", "dyna@damping", "dyna@frictionloss"):
            of = {"dyna@armature": armature, "dyna@damping": damping, "dyna@frictionloss": dry}[what]
            of[arm.hinge[arm.joints.index(thing)]] = value
        elif thing in arm.bodies and what == "dyna@mass":
            k = arm.link(thing)
            mass[k], inertia[k] = value, inertia[k] * value / mass[k]
        elif thing in arm.bodies and what in ("dyna@centre_x", "dyna@centre_y", "dyna@centre_z"):
            centre[arm.link(thing), "xyz".index(what[-1])] = value
        else:
            raise ConfigError(f"parameter {name}: the concealed arms know no such quantity")
    return replace(
        arm, armature=armature, damping=damping, dry=dry, zero=zero, mass=mass, centre=centre, inertia=inertia,
        stiffness=stiffness, delay=delay,
    )  # fmt: skip

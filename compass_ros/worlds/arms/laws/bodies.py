"""What hangs on the arm, and what the arm stands on.

Payload: mass, centre and inertia are added as those of one rigid body (parallel axes): Khosla and Kanade, Parameter
identification of robot dynamics, CDC 1985; Swevers, Ganseman, De Schutter and Van Brussel, Experimental robot
identification using optimised periodic trajectories, Mechanical Systems and Signal Processing 10(5), 1996, for
payloads beside the axis. Tilted base: gravity's direction as parameter, Atkeson, An and Hollerbach, Estimation of
inertial parameters of manipulator loads and links, International Journal of Robotics Research 5(3), 1986.
Loose base: two springs with dampers under the foot, as Lew and Moon, A simple active damping control for compliant
base manipulators, IEEE/ASME Transactions on Mechatronics 6(3), 2001; natural frequencies of 1.5 to 12 Hz.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from compass_ros.types import Floats
from compass_ros.worlds.arms.arm import Arm
from compass_ros.worlds.arms.law import Law, Moment, listed
from compass_ros.worlds.world import UNKNOWN, Missing


@dataclass(frozen=True)
class Payload(Law):
    """A ball at a point of the last link."""

    mass: float
    """[kg]"""
    place: Floats
    """(3,) in the link [m]."""
    radius: float
    """[m]"""

    def fitted(self, arm: Arm) -> Arm:
        k = arm.link(arm.bodies[-1])
        mass, centre, inertia = arm.mass.copy(), arm.centre.copy(), arm.inertia.copy()
        mass[k] += self.mass
        centre[k] = (arm.mass[k] * arm.centre[k] + self.mass * self.place) / mass[k]
        own = 0.4 * self.mass * self.radius**2 * np.eye(3)
        inertia[k] += own + _point(arm.mass[k], arm.centre[k] - centre[k]) + _point(self.mass, self.place - centre[k])
        return replace(arm, mass=mass, centre=centre, inertia=inertia)

    def missing(self, arm: Arm) -> Missing:
        said = listed(mass_kg=self.mass, place_m=self.place, radius_m=self.radius)
        return Missing("payload_ball", ("payload",), (arm.bodies[-1],), said, "Swevers et al. 1996, MSSP 10(5)")


def _point(mass: float, arm: Floats) -> Floats:
    """(3, 3) inertia of a point at (3,) from the axes' origin."""
    return np.asarray(mass * (arm @ arm * np.eye(3) - np.outer(arm, arm)))


@dataclass(frozen=True)
class TiltedBase(Law):
    """The base stands askew."""

    tilt: Floats
    """(2,) rotation about the base's x and y [rad]."""

    def fitted(self, arm: Arm) -> Arm:
        size = float(np.linalg.norm(arm.gravity))
        x, y = np.tan(self.tilt)
        down = np.array([y, -x, -1.0])
        return replace(arm, gravity=size * down / np.linalg.norm(down))

    def missing(self, arm: Arm) -> Missing:
        source = "Atkeson, An and Hollerbach 1986, IJRR 5(3)"
        return Missing("tilted_base", ("gravity_tilt",), ("world",), listed(tilt_rad=self.tilt), source)


@dataclass(frozen=True)
class LooseBase(Law):
    """The foot rocks about the world's x and y."""

    stiffness: Floats
    """(2,) [N m/rad]"""
    damping: Floats
    """(2,) [N m s/rad]"""
    inertia: float
    """Of the foot [kg m^2]."""

    def fitted(self, arm: Arm) -> Arm:
        def led(own: Floats, value: float | Floats) -> Floats:
            first = np.broadcast_to(np.asarray(value, float), (2, *own.shape[1:]))
            return np.concatenate([first, own])

        return replace(
            arm,
            origin=led(arm.origin, 0.0), turn=led(arm.turn, np.eye(3)), axis=led(arm.axis, np.eye(3)[:2]),
            mass=led(arm.mass, 0.0), centre=led(arm.centre, 0.0), inertia=led(arm.inertia, 0.0),
            armature=led(arm.armature, self.inertia), damping=led(arm.damping, 0.0), dry=led(arm.dry, 0.0),
            soft=led(arm.soft, 1.0), back=led(arm.back, 0.0), hinge=arm.hinge + 2, motor=arm.motor + 2,
        )  # fmt: skip

    def force(self, moment: Moment, inner: Floats, effort: Floats) -> Floats:
        out = np.zeros_like(moment.q)
        out[:, :2] = -self.stiffness * moment.q[:, :2] - self.damping * moment.v[:, :2]
        return out

    def missing(self, arm: Arm) -> Missing:
        said = listed(stiffness_nm_rad=self.stiffness, damping_nm_s_rad=self.damping, inertia_kg_m2=self.inertia)
        source = "Lew and Moon 2001, IEEE/ASME TMECH 6(3)"
        return Missing("loose_base", (UNKNOWN,), ("world",), said, source)

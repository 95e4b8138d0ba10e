"""Gears between a rotor and its link: stiffening springs with hysteresis, play, transmission error.

Stiffness in three ranges: Harmonic Drive SE, CSG-2A engineering data: K2 / K1 = 1.3 to 1.6 and K3 / K1 = 1.5 to 1.8
of sizes 14 to 25, ranges that end at 0.06 and 0.2 of the peak torque; hysteresis loss of about one minute of arc.
Form of the hysteresis, a bristle beside the spring: Seyfferth, Maghzal and Angeles, Nonlinear modeling and parameter
identification of harmonic drive robotic transmissions, ICRA 1995.
Play: Nordin and Gutman, Controlling mechanical systems with backlash - a survey, Automatica 38(10), 2002: a dead
zone of the twist before a shaft with stiffness and damping, which pushes and does not pull.
Transmission error: Ghorbel, Gandhi and Alpeter, On the kinematic error in harmonic drive gears, Journal of Mechanical
Design 123(1), 2001: waves twice (and four times) a turn of the wave generator, 0.2 to 2 mrad at the output.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from compass_ros.types import Floats, Ints
from compass_ros.worlds.arms.arm import IMPEDANCE, Arm
from compass_ros.worlds.arms.law import Law, Moment, listed, of_joints
from compass_ros.worlds.arms.laws.bristles import relaxed
from compass_ros.worlds.world import UNKNOWN, Missing


@dataclass(frozen=True)
class Geared(Law):
    """The rotor (the drawing's armature), its friction and its servo turn before the gear; encoders show the link."""

    def fitted(self, arm: Arm) -> Arm:
        joints = arm.hinge[self.at]
        count = len(arm.armature)
        motor = arm.motor.copy()
        motor[self.at] = count + np.arange(len(self.sites))
        rotor = arm.armature[joints]
        armature, damping, dry = (_moved(own, joints) for own in (arm.armature, arm.damping, arm.dry))
        soft = np.concatenate([arm.soft, (1 - IMPEDANCE) / IMPEDANCE / rotor])
        back = np.concatenate([arm.back, arm.back[joints]])
        return replace(arm, motor=motor, armature=armature, damping=damping, dry=dry, soft=soft, back=back)

    def twist(self, moment: Moment) -> tuple[Floats, Floats]:
        """(E, S) of rotor against link, and its rate."""
        arm = moment.arm
        hinge, motor = arm.hinge[self.at], arm.motor[self.at]
        return moment.q[:, motor] - moment.q[:, hinge], moment.v[:, motor] - moment.v[:, hinge]

    def transmit(self, moment: Moment, torque: Floats) -> Floats:
        """(E, N) for (E, S) on the links; the rotors take as much the other way."""
        out, arm = np.zeros_like(moment.q), moment.arm
        out[:, arm.hinge[self.at]] = torque
        out[:, arm.motor[self.at]] = -torque
        return out


def _moved(own: Floats, joints: Ints) -> Floats:
    """(N + S,) from the joints (S,) to their rotors."""
    moved: Floats = np.concatenate([own, own[joints]])
    moved[joints] = 0.0
    return moved


@dataclass(frozen=True)
class FlexibleGear(Geared):
    """Stiffer under load, with hysteresis."""

    stiffness: Floats
    """(S,) of the first range [N m/rad]."""
    second: Floats
    """(S, 2) stiffness of the second and third range over the first's."""
    ends: Floats
    """(S, 2) torques at which the first and second range end [N m]."""
    damping: Floats
    """(S,) [N m s/rad]"""
    loop: Floats
    """(S,) torque of the bristle [N m]."""
    bristle: Floats
    """(S,) twist at which the bristle slips [rad]."""

    def begin(self, episodes: int) -> Floats:
        return np.zeros((episodes, len(self.sites)))

    def advance(self, moment: Moment, inner: Floats, seconds: float) -> Floats:
        return relaxed(inner, self.twist(moment)[1], self.bristle, seconds)

    def spring(self, twist: Floats) -> Floats:
        """(E, S) torque of the three ranges."""
        size = np.abs(twist)
        first = self.ends[:, 0] / self.stiffness
        second = first + (self.ends[:, 1] - self.ends[:, 0]) / (self.stiffness * self.second[:, 0])
        more = (self.second[:, 0] - 1) * np.maximum(size - first, 0)
        most = (self.second[:, 1] - self.second[:, 0]) * np.maximum(size - second, 0)
        return np.asarray(np.sign(twist) * self.stiffness * (size + more + most))

    def force(self, moment: Moment, inner: Floats, effort: Floats) -> Floats:
        twist, rate = self.twist(moment)
        return self.transmit(moment, self.spring(twist) + self.damping * rate + self.loop / self.bristle * inner)

    def missing(self, arm: Arm) -> Missing:
        said = listed(
            stiffness_nm_rad=self.stiffness, stiffening=self.second, ends_nm=self.ends, damping_nm_s_rad=self.damping,
            loop_nm=self.loop, bristle_rad=self.bristle,
        )  # fmt: skip
        source = "Seyfferth et al. 1995, ICRA; Harmonic Drive SE, CSG-2A engineering data"
        return Missing("flexible_gear", ("joint_elasticity",), of_joints(self, arm), said, source)


@dataclass(frozen=True)
class Play(Geared):
    """A gap before a stiff shaft."""

    gap: Floats
    """(S,) whole [rad]."""
    stiffness: Floats
    """(S,) [N m/rad]"""
    damping: Floats
    """(S,) [N m s/rad]"""

    def contact(self, twist: Floats, rate: Floats) -> Floats:
        """(E, S) torque on the link."""
        beyond = twist - np.clip(twist, -0.5 * self.gap, 0.5 * self.gap)
        side = np.sign(beyond)
        pushing = side * (self.stiffness * beyond + self.damping * rate)
        return np.asarray(side * np.maximum(pushing, 0.0))

    def force(self, moment: Moment, inner: Floats, effort: Floats) -> Floats:
        return self.transmit(moment, self.contact(*self.twist(moment)))

    def missing(self, arm: Arm) -> Missing:
        said = listed(gap_rad=self.gap, stiffness_nm_rad=self.stiffness, damping_nm_s_rad=self.damping)
        return Missing(
            "gear_play", ("backlash",), of_joints(self, arm), said, "Nordin and Gutman 2002, Automatica 38(10)"
        )


@dataclass(frozen=True)
class TransmissionError(Geared):
    """A stiff gear whose link is not where its rotor says: it waves with the rotor's angle."""

    size: Floats
    """(S, 2) of both waves [rad]."""
    waves: Floats
    """(S,) of the first, a turn of the link: twice the ratio of the gear."""
    phase: Floats
    """(S, 2) [rad]"""
    stiffness: Floats
    """(S,) [N m/rad]"""
    damping: Floats
    """(S,) [N m s/rad]"""

    def wave(self, rotor: Floats) -> tuple[Floats, Floats]:
        """(E, S) by how much the link is ahead of its rotor at the rotor's angle, and the slope of that."""
        order = np.array([1.0, 2.0]) * self.waves[:, None]
        angle = order * rotor[..., None] + self.phase
        ahead, slope = self.size * np.sin(angle), self.size * order * np.cos(angle)
        return np.asarray(ahead.sum(axis=-1)), np.asarray(slope.sum(axis=-1))

    def force(self, moment: Moment, inner: Floats, effort: Floats) -> Floats:
        arm = moment.arm
        twist, rate = self.twist(moment)
        ahead, slope = self.wave(moment.motor_q[:, self.at])
        rate = rate + slope * moment.motor_v[:, self.at]
        torque: Floats = np.asarray(self.stiffness * (twist + ahead) + self.damping * rate)
        out = self.transmit(moment, torque)
        out[:, arm.motor[self.at]] = -torque * (1 + slope)  # virtual work: no energy is lost or won in the waves
        return out

    def missing(self, arm: Arm) -> Missing:
        said = listed(
            size_rad=self.size, waves_a_turn=self.waves, phase_rad=self.phase, stiffness_nm_rad=self.stiffness
        )
        source = "Ghorbel, Gandhi and Alpeter 2001, Journal of Mechanical Design 123(1)"
        return Missing("transmission_error", (UNKNOWN,), of_joints(self, arm), said, source)

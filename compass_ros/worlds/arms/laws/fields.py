"""Torques that depend on the angle, and a brake that depends on speed.

Cogging with harmonics: Jahns and Soong, Pulsating torque minimization techniques for permanent magnet AC motor
drives - a review, IEEE Transactions on Industrial Electronics 43(2), 1996.
Coil spring between base and link: Rahman, Ramanathan, Seliktar and Harwin, A simple technique to passively
gravity-balance articulated mechanisms, Journal of Mechanical Design 117(4), 1995.
Hoses and cables that stiffen as they wind up: Abele, Bauer, Rothenbuecher, Stelzer and von Stryk, Prediction of the
tool displacement by coupled models of the compliant industrial robot, 2008, has linear and cubic parts for joint
springs. Eddy-current brake: Wouterse, Critical torque and speed of eddy current brake with widely separated soft
iron poles, IEE Proceedings B 138(4), 1991: torque 2 T / (v / c + c / v), highest at the critical speed c.
"""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass

import numpy as np

from compass_ros.types import Floats
from compass_ros.worlds.arms.arm import Arm
from compass_ros.worlds.arms.law import Law, Moment, listed, of_joints
from compass_ros.worlds.world import UNKNOWN, Missing


@dataclass(frozen=True)
class _Torque(Law):
    """One on each motor, (E, S) by angle and rate."""

    @abstractmethod
    def torque(self, angle: Floats, rate: Floats) -> Floats:
        """(E, S) [N m] of (E, S) angles and rates."""

    def force(self, moment: Moment, inner: Floats, effort: Floats) -> Floats:
        torque = np.zeros_like(effort)
        torque[:, self.at] = self.torque(moment.motor_q[:, self.at], moment.motor_v[:, self.at])
        return moment.on_motors(torque)


@dataclass(frozen=True)
class Cogging(_Torque):
    """Repeats `teeth` times a turn, with harmonics."""

    size: Floats
    """(S,) of the first harmonic [N m]."""
    teeth: Floats
    """(S,) whole numbers."""
    harmonics: Floats
    """(S, H) sizes over the first one's, beginning with 1."""
    phase: Floats
    """(S, H) [rad]"""

    def torque(self, angle: Floats, rate: Floats) -> Floats:
        order = np.arange(1, self.harmonics.shape[1] + 1)
        waves = self.harmonics * np.sin(order * self.teeth[:, None] * angle[..., None] + self.phase)
        return np.asarray(self.size * waves.sum(axis=-1))

    def missing(self, arm: Arm) -> Missing:
        said = listed(size_nm=self.size, teeth=self.teeth, harmonics=self.harmonics, phase_rad=self.phase)
        source = "Jahns and Soong 1996, IEEE TIE 43(2)"
        return Missing("cogging_harmonics", ("cogging",), of_joints(self, arm), said, source)


@dataclass(frozen=True)
class BalanceSpring(_Torque):
    """A coil spring from a point of the base to a point of the link."""

    rate_n_m: Floats
    """(S,) [N/m]"""
    base_m: Floats
    """(S,) distance of its end at the base from the joint."""
    link_m: Floats
    """(S,) of its end at the link."""
    free_m: Floats
    """(S,) its free length."""
    angle: Floats
    """(S,) of the joint at which both ends are in line [rad]."""

    def energy(self, angle: Floats) -> Floats:
        """(E, S) [J]"""
        return np.asarray(0.5 * self.rate_n_m * (self._length(angle) - self.free_m) ** 2)

    def _length(self, angle: Floats) -> Floats:
        square = self.base_m**2 + self.link_m**2 - 2 * self.base_m * self.link_m * np.cos(angle - self.angle)
        return np.asarray(np.sqrt(square))

    def torque(self, angle: Floats, rate: Floats) -> Floats:
        length = self._length(angle)
        lever = self.base_m * self.link_m * np.sin(angle - self.angle) / length
        return np.asarray(-self.rate_n_m * (length - self.free_m) * lever)

    def missing(self, arm: Arm) -> Missing:
        said = listed(
            rate_n_m=self.rate_n_m, base_m=self.base_m, link_m=self.link_m, free_m=self.free_m, angle_rad=self.angle
        )
        source = "Rahman et al. 1995, Journal of Mechanical Design 117(4)"
        return Missing("balance_spring", ("spring",), of_joints(self, arm), said, source)


@dataclass(frozen=True)
class DressPack(_Torque):
    """Hoses along the arm."""

    linear: Floats
    """(S,) [N m/rad]"""
    cubic: Floats
    """(S,) [N m/rad^3]"""
    rest: Floats
    """(S,) angle at which they are slack [rad]."""

    def torque(self, angle: Floats, rate: Floats) -> Floats:
        wound = angle - self.rest
        return np.asarray(-self.linear * wound - self.cubic * wound**3)

    def missing(self, arm: Arm) -> Missing:
        said = listed(linear_nm_rad=self.linear, cubic_nm_rad3=self.cubic, rest_rad=self.rest)
        return Missing("dress_pack", ("spring",), of_joints(self, arm), said, "Abele et al. 2008")


@dataclass(frozen=True)
class EddyBrake(_Torque):
    """Brakes less above its critical speed."""

    peak: Floats
    """(S,) [N m]"""
    critical: Floats
    """(S,) [rad/s]"""

    def torque(self, angle: Floats, rate: Floats) -> Floats:
        share = rate / self.critical
        return np.asarray(-2 * self.peak * share / (1 + share**2))

    def missing(self, arm: Arm) -> Missing:
        said = listed(peak_nm=self.peak, critical_rad_s=self.critical)
        return Missing("eddy_brake", (UNKNOWN,), of_joints(self, arm), said, "Wouterse 1991, IEE Proceedings B 138(4)")

"""Friction with bristles: LuGre and Dahl.

LuGre: Canudas de Wit, Olsson, Astrom and Lischinsky, A new model for control of systems with friction, IEEE
Transactions on Automatic Control 40(3), 1995, equations 1 to 4 and table 1: static over Coulomb friction 1.5, sigma1
= sqrt(sigma0 m). Stribeck speeds of geared joints, 0.02 to 0.15 rad/s: Armstrong-Helouvry, Dupont and Canudas de
Wit, A survey of models, analysis tools and compensation methods for the control of machines with friction,
Automatica 30(7), 1994.

Dahl: Dahl, Solid friction damping of mechanical vibrations, AIAA Journal 14(12), 1976, with exponent 1. Harnesses and
seals slide before they slip by tens of milliradians, and hold a joint as a spring with loss until then.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from compass_ros.types import Floats
from compass_ros.worlds.arms.arm import Arm
from compass_ros.worlds.arms.law import Law, Moment, listed, of_joints
from compass_ros.worlds.world import UNKNOWN, Missing


def relaxed(deflection: Floats, rate: Floats, longest: Floats, seconds: float) -> Floats:
    """Deflection z after some time, of z' = v - |v| z / longest at a constant rate v: the exact solution."""
    end = np.sign(rate) * longest
    return np.asarray(end + (deflection - end) * np.exp(-np.abs(rate) * seconds / longest))


@dataclass(frozen=True)
class LuGre(Law):
    """In the place of the drawing's dry friction; its viscous part is the drawing's."""

    coulomb: Floats
    """(S,) [N m]"""
    static: Floats
    """(S,) [N m]"""
    stribeck: Floats
    """(S,) speed [rad/s]"""
    bristle: Floats
    """(S,) deflection at which the Coulomb torque is reached [rad]."""
    microdamping: Floats
    """(S,) sigma1 [N m s/rad]"""

    def fitted(self, arm: Arm) -> Arm:
        dry = arm.dry.copy()
        dry[arm.motor[self.at]] = 0.0
        return replace(arm, dry=dry)

    def begin(self, episodes: int) -> Floats:
        return np.zeros((episodes, len(self.sites)))

    def _longest(self, rate: Floats) -> Floats:
        level = self.coulomb + (self.static - self.coulomb) * np.exp(-((rate / self.stribeck) ** 2))
        return np.asarray(level * self.bristle / self.coulomb)

    def advance(self, moment: Moment, inner: Floats, seconds: float) -> Floats:
        rate = moment.motor_v[:, self.at]
        return relaxed(inner, rate, self._longest(rate), seconds)

    def force(self, moment: Moment, inner: Floats, effort: Floats) -> Floats:
        rate = moment.motor_v[:, self.at]
        bending = rate - np.abs(rate) * inner / self._longest(rate)
        torque = np.zeros_like(effort)
        torque[:, self.at] = -self.coulomb / self.bristle * inner - self.microdamping * bending
        return moment.on_motors(torque)

    def missing(self, arm: Arm) -> Missing:
        said = listed(
            coulomb_nm=self.coulomb, static_nm=self.static, stribeck_rad_s=self.stribeck, bristle_rad=self.bristle
        )
        source = "Canudas de Wit et al. 1995, IEEE TAC 40(3)"
        return Missing("lugre_friction", ("stribeck_friction",), of_joints(self, arm), said, source)


@dataclass(frozen=True)
class Dahl(Law):
    """Beside the drawing's dry friction."""

    level: Floats
    """(S,) torque at which it slips [N m]."""
    bristle: Floats
    """(S,) deflection at which it slips [rad]."""

    def begin(self, episodes: int) -> Floats:
        return np.zeros((episodes, len(self.sites)))

    def advance(self, moment: Moment, inner: Floats, seconds: float) -> Floats:
        return relaxed(inner, moment.motor_v[:, self.at], self.bristle, seconds)

    def force(self, moment: Moment, inner: Floats, effort: Floats) -> Floats:
        torque = np.zeros_like(effort)
        torque[:, self.at] = -self.level / self.bristle * inner
        return moment.on_motors(torque)

    def missing(self, arm: Arm) -> Missing:
        said = listed(level_nm=self.level, bristle_rad=self.bristle)
        return Missing("dahl_harness", (UNKNOWN,), of_joints(self, arm), said, "Dahl 1976, AIAA Journal 14(12)")

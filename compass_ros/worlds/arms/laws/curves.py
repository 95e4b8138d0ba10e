"""Friction that is a curve of speed, load or direction, and locks at rest.

Speed and load: Bittencourt and Gunnarsson, Static friction in a robot joint - modeling and identification of load and
temperature effects, Journal of Dynamic Systems, Measurement, and Control 134(5), 2012: Stribeck's exponent 1.3;
Coulomb friction grows by 0.023 and friction at rest by 0.126 of the load; the part of the load fades above 0.092
rad/s.

Direction: Coulomb friction of a PUMA 560 in both directions, Corke and Armstrong-Helouvry, A search for consensus
among model parameters reported for the PUMA 560 robot, ICRA 1994: of its joints one to six, 0.395 and 0.435, 0.126
and 0.071, 0.132 and 0.105, 0.0112 and 0.0169, 0.00926 and 0.0145, 0.00396 and 0.0105 N m at the motor.

Place: Armstrong-Helouvry, Control of Machines with Friction, Kluwer 1991: friction that repeats with the joint's
turns.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from compass_ros.types import Floats
from compass_ros.worlds.arms.arm import Arm
from compass_ros.worlds.arms.law import Law, Moment, listed, of_joints
from compass_ros.worlds.world import UNKNOWN, Missing

EXPONENT = 1.3
LOAD_SPEED = 0.0922
"""[rad/s]"""
PUMA = ((0.395, 0.435), (0.126, 0.071), (0.132, 0.105), (0.0112, 0.0169), (0.00926, 0.0145), (0.00396, 0.0105))
SKEWS = tuple((there - back) / (there + back) for there, back in PUMA)
"""Half the difference of both directions over their mean."""
Bounds = tuple[Floats, Floats]


def widened(moment: Moment, sites: list[int], bounds: Bounds, more: Floats) -> Bounds:
    """Bounds of dry friction, `more` (E, S) to either side."""
    lower, upper = bounds[0].copy(), bounds[1].copy()
    at = moment.arm.motor[sites]
    lower[:, at] -= more
    upper[:, at] += more
    return lower, upper


@dataclass(frozen=True)
class StribeckCurve(Law):
    """Higher at rest."""

    excess: Floats
    """(S,) at rest, over the drawing's dry friction [N m]."""
    speed: Floats
    """(S,) [rad/s]"""

    def fitted(self, arm: Arm) -> Arm:
        return arm.locking(np.array(self.at))

    def bounds(self, moment: Moment, effort: Floats, bounds: Bounds) -> Bounds:
        rate = np.abs(moment.motor_v[:, self.at])
        return widened(moment, self.at, bounds, self.excess * np.exp(-((rate / self.speed) ** EXPONENT)))

    def missing(self, arm: Arm) -> Missing:
        said = listed(excess_nm=self.excess, speed_rad_s=self.speed)
        source = "Bittencourt and Gunnarsson 2012, ASME JDSMC 134(5)"
        return Missing("stribeck_curve", ("stribeck_friction",), of_joints(self, arm), said, source)


@dataclass(frozen=True)
class LoadFriction(Law):
    """Grows with the torque that the gear carries."""

    share: Floats
    """(S,) of the load, at any speed."""
    at_rest: Floats
    """(S,) of the load, fading with speed."""

    def bounds(self, moment: Moment, effort: Floats, bounds: Bounds) -> Bounds:
        rate, load = np.abs(moment.motor_v[:, self.at]), np.abs(effort[:, self.at])
        fading = np.exp(-((rate / LOAD_SPEED) ** EXPONENT))
        return widened(moment, self.at, bounds, load * (self.share + self.at_rest * fading))

    def missing(self, arm: Arm) -> Missing:
        said = listed(share=self.share, share_at_rest=self.at_rest)
        source = "Bittencourt and Gunnarsson 2012, ASME JDSMC 134(5)"
        return Missing("load_friction", ("load_dependent_friction",), of_joints(self, arm), said, source)


@dataclass(frozen=True)
class SkewFriction(Law):
    """Another dry friction in each direction, their mean the drawing's."""

    skew: Floats
    """(S,) half the difference over the mean; positive: higher in the positive direction."""

    def bounds(self, moment: Moment, effort: Floats, bounds: Bounds) -> Bounds:
        lower, upper = bounds[0].copy(), bounds[1].copy()
        at = moment.arm.motor[self.at]
        lower[:, at] *= 1 + self.skew
        upper[:, at] *= 1 - self.skew
        return lower, upper

    def missing(self, arm: Arm) -> Missing:
        source = "Corke and Armstrong-Helouvry 1994, ICRA"
        said = listed(skew=self.skew)
        return Missing("skew_friction", ("asymmetric_friction",), of_joints(self, arm), said, source)


@dataclass(frozen=True)
class PlaceFriction(Law):
    """Dry friction that rises and falls once a turn: a bent shaft, a bearing out of line."""

    swing: Floats
    """(S,) over the mean."""
    phase: Floats
    """(S,) [rad]"""

    def bounds(self, moment: Moment, effort: Floats, bounds: Bounds) -> Bounds:
        lower, upper = bounds[0].copy(), bounds[1].copy()
        at = moment.arm.motor[self.at]
        share = 1 + self.swing * np.cos(2 * moment.motor_q[:, self.at] + self.phase)
        lower[:, at] *= share
        upper[:, at] *= share
        return lower, upper

    def missing(self, arm: Arm) -> Missing:
        said = listed(swing=self.swing, phase_rad=self.phase)
        return Missing("place_friction", (UNKNOWN,), of_joints(self, arm), said, "Armstrong-Helouvry 1991, Kluwer")

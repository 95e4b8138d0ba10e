"""Friction that falls while the gears warm up.

Bittencourt and Gunnarsson 2012 (as in curves.py) and Simoni, Beschi, Legnani and Visioli, Modelling the temperature
in joint friction of industrial manipulators, Robotica 37(5), 2019: friction halves between a cold start and a warm
gear, and the temperature nears its end exponentially within minutes to hours.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from compass_ros.types import Floats
from compass_ros.worlds.arms.arm import Arm
from compass_ros.worlds.arms.law import Law, Moment, listed, of_joints
from compass_ros.worlds.world import UNKNOWN, Missing


@dataclass(frozen=True)
class WarmingUp(Law):
    """Dry and viscous friction of the drawing are those of the warm gear."""

    excess: Floats
    """(S,) at the start of the session, over the warm gear's."""
    constant_s: float
    """Time constant of the temperature."""

    def _share(self, moment: Moment) -> Floats:
        return np.asarray(self.excess * np.exp(-(moment.session_s + moment.time_s) / self.constant_s)[:, None])

    def force(self, moment: Moment, inner: Floats, effort: Floats) -> Floats:
        torque = np.zeros_like(effort)
        viscous = moment.arm.damping[moment.arm.motor[self.at]]
        torque[:, self.at] = -viscous * self._share(moment) * moment.motor_v[:, self.at]
        return moment.on_motors(torque)

    def bounds(self, moment: Moment, effort: Floats, bounds: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
        lower, upper = bounds[0].copy(), bounds[1].copy()
        at = moment.arm.motor[self.at]
        lower[:, at] *= 1 + self._share(moment)
        upper[:, at] *= 1 + self._share(moment)
        return lower, upper

    def missing(self, arm: Arm) -> Missing:
        said = listed(excess=self.excess, constant_s=self.constant_s)
        source = "Bittencourt and Gunnarsson 2012, ASME JDSMC 134(5); Simoni et al. 2019, Robotica 37(5)"
        return Missing("warming_up", (UNKNOWN,), of_joints(self, arm), said, source)

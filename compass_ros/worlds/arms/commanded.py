"""Arms whose servos are commanded: the motion that is drawn for them, or that of given commands."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from compass_ros.types import Floats
from compass_ros.worlds.arms.arm import Arm
from compass_ros.worlds.arms.motions import RATE_HZ, Range, commands, driven
from compass_ros.worlds.arms.scene import Motion


@dataclass(frozen=True)
class Commanded:
    """Positions that are told at RATE_HZ."""

    ranges: list[Range]
    seconds: float
    linear: bool = False
    """The servo follows lines between the commands; else it holds each until the next."""

    def drawn(self, arm: Arm, rng: Generator) -> Motion:
        """Waves and moves within the ranges."""
        return self.told(arm, commands(self.ranges, self.seconds, rng)[1], rng)

    def told(self, arm: Arm, targets: Floats, rng: Generator) -> Motion:
        """The motion of (E, n, J) positions [rad]."""
        time = np.arange(targets.shape[1]) / RATE_HZ
        return Motion(driven(time, targets, arm.delay, self.linear, rng), time, targets)

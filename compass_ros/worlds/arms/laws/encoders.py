"""What encoders and their clocks get wrong.

Magnet beside the axis: ams AG, AS5048A/AS5048B datasheet, 2018, integral non-linearity up to 1.2 degrees (21 mrad)
with the magnet 0.25 mm off the centre; once a turn, and a part of it twice a turn.
Clock of a controller without a crystal: Atmel, ATmega48/88/168/328 datasheet, 2016, calibrated internal RC
oscillator: 10 % as it leaves the factory, 1 % calibrated by the user.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from compass_ros.types import Floats
from compass_ros.worlds.arms.arm import Arm
from compass_ros.worlds.arms.law import Law, listed, of_joints
from compass_ros.worlds.world import Missing


@dataclass(frozen=True)
class MagnetOffCentre(Law):
    """What is recorded waves with the angle; the servos have encoders of their own."""

    size: Floats
    """(S, 2) once and twice a turn [rad]."""
    phase: Floats
    """(S, 2) [rad]"""

    def seen(self, shown: Floats) -> Floats:
        out = shown.copy()
        angle = shown[:, :, self.at, None] * np.array([1.0, 2.0]) + self.phase
        out[:, :, self.at] += np.sum(self.size * (np.sin(angle) - np.sin(self.phase)), axis=-1)
        return np.asarray(out)

    def missing(self, arm: Arm) -> Missing:
        said = listed(size_rad=self.size, phase_rad=self.phase)
        return Missing(
            "magnet_off_centre", ("eccentricity",), of_joints(self, arm), said, "ams AG 2018, AS5048A datasheet"
        )


@dataclass(frozen=True)
class SlowClock(Law):
    """The stamps of the joint states run away from those of the commands, from each recording's beginning."""

    slow: float
    """A second of the clock is 1 + slow seconds."""

    def clock(self, time_s: Floats) -> Floats:
        return time_s * (1 + self.slow)

    def missing(self, arm: Arm) -> Missing:
        said = listed(slow=self.slow)
        return Missing("slow_clock", ("clock_drift",), ("joints",), said, "Atmel 2016, ATmega328P datasheet")

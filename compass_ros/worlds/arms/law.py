"""What a law of an arm may do. A law changes the numbers of the arm, or adds to what acts at each moment."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from compass_ros.types import Floats
from compass_ros.worlds.arms.arm import Arm
from compass_ros.worlds.world import Missing


@dataclass(frozen=True)
class Moment:
    """The state of E arms at one time."""

    arm: Arm
    time_s: float
    """Since the start of the recording; negative before."""
    session_s: Floats
    """(E,) when each recording began, since the first one."""
    q: Floats
    """(E, N) angles [rad]."""
    v: Floats
    """(E, N) rates [rad/s]."""

    @property
    def motor_q(self) -> Floats:
        """(E, J) what the drives turn."""
        return np.asarray(self.q[:, self.arm.motor])

    @property
    def motor_v(self) -> Floats:
        return np.asarray(self.v[:, self.arm.motor])

    def on_motors(self, torque: Floats) -> Floats:
        """(E, N) generalised torques for (E, J) on what the drives turn."""
        out = np.zeros_like(self.q)
        out[:, self.arm.motor] = torque
        return out


@dataclass(frozen=True)
class Law(ABC):
    """Does nothing; a law overrides what it needs. Numbers of joints are (S,), in the order of `sites`."""

    sites: tuple[int, ...]
    """Indices of the joints where it acts."""

    @property
    def at(self) -> list[int]:
        return list(self.sites)

    def fitted(self, arm: Arm) -> Arm:
        """The arm with what this law changes in it."""
        return arm

    def command(self, time_s: Floats, target: Floats) -> Floats:
        """What the servos are told, (E, T, J) at (T,) times, for what was recorded as command."""
        return target

    def begin(self, episodes: int) -> Floats:
        """(E, K) internal state of a robot that has not moved."""
        return np.zeros((episodes, 0))

    def advance(self, moment: Moment, inner: Floats, seconds: float) -> Floats:
        """Internal state after some time at the moment's rates."""
        return inner

    def error(self, moment: Moment, error: Floats) -> Floats:
        """(E, J) what the servos take for their error of position [rad]."""
        return error

    def effort(self, moment: Moment, effort: Floats) -> Floats:
        """(E, J) torque of the drives, for what the servos ask for."""
        return effort

    def force(self, moment: Moment, inner: Floats, effort: Floats) -> Floats | float:
        """(E, N) further torques; `effort`: (E, J) of the drives."""
        return 0.0

    def bounds(self, moment: Moment, effort: Floats, bounds: tuple[Floats, Floats]) -> tuple[Floats, Floats]:
        """(E, N) lowest and highest torque of dry friction."""
        return bounds

    def seen(self, shown: Floats) -> Floats:
        """(E, F, J) what the encoders show, for angles."""
        return shown

    def clock(self, time_s: Floats) -> Floats:
        """(F,) when the joint states were taken that are stamped with (F,) times."""
        return time_s

    @abstractmethod
    def missing(self, arm: Arm) -> Missing:
        """What the answer says of it."""


def of_joints(law: Law, arm: Arm) -> tuple[str, ...]:
    """Names of the joints where a law acts."""
    return tuple(arm.joints[j] for j in law.sites)


def listed(**quantities: Floats | float) -> Mapping[str, float | list[float]]:
    """Quantities as plain numbers and lists."""
    return {name: np.asarray(value).tolist() for name, value in quantities.items()}

"""What servos do with a command, and what their drives cannot do.

Saturation with back-EMF and sagging supply: Krishnan, Electric Motor Drives, Prentice Hall 2001, chapter 2: torque
kt (V - R_b sum(i) - kt v) / R; V falls with the currents of all joints.
Dead band: ROBOTIS, AX-12A e-Manual, compliance margin: within it there is no output; one count is 5.1 mrad.
Play in the command (a cable pulled one way, then the other): Su, Stepanenko, Svoboda and Leung, Robust adaptive
control of a class of nonlinear systems with unknown backlash-like hysteresis, IEEE TAC 45(12), 2000; here its limit
with vertical sides. Latency of the line: FTDI, AN232B-04 Data Throughput, Latency and Handshaking, 2006: up to 16 ms
a transfer, each way. Profile speed: ROBOTIS, XL430-W250 e-Manual, profile velocity 0.0024 to 3 rad/s: a target is
neared at this speed at most. Smoothing: ROBOTIS, XL430-W250 e-Manual, feedforward and profile; two equal first-order
filters (critically damped).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from compass_ros.types import Floats
from compass_ros.worlds.arms.arm import Arm
from compass_ros.worlds.arms.law import Law, Moment, listed, of_joints
from compass_ros.worlds.world import Missing


@dataclass(frozen=True)
class SaggingDrive(Law):
    """Less torque at speed, and while other joints pull."""

    stall: Floats
    """(S,) torque at rest with a full supply [N m]."""
    free: Floats
    """(S,) speed without load [rad/s]."""
    sag: float
    """Share of the supply that is lost when all of these drives stall."""

    def effort(self, moment: Moment, effort: Floats) -> Floats:
        out, rate = effort.copy(), moment.motor_v[:, self.at]
        asked = np.abs(effort[:, self.at]) / self.stall
        supply = 1 - self.sag * np.minimum(asked, 1).mean(axis=1, keepdims=True)
        high = self.stall * np.maximum(supply - rate / self.free, 0)
        low = -self.stall * np.maximum(supply + rate / self.free, 0)
        out[:, self.at] = np.clip(effort[:, self.at], low, high)
        return np.asarray(out)

    def missing(self, arm: Arm) -> Missing:
        said = listed(stall_nm=self.stall, free_rad_s=self.free, sag=self.sag)
        classes = ("torque_saturation", "velocity_saturation")
        return Missing("sagging_drive", classes, of_joints(self, arm), said, "Krishnan 2001, Electric Motor Drives")


@dataclass(frozen=True)
class ComplianceMargin(Law):
    """No torque from small errors; beyond them the whole of it."""

    margin: Floats
    """(S,) to either side [rad]."""

    def error(self, moment: Moment, error: Floats) -> Floats:
        out = error.copy()
        own = out[:, self.at]
        out[:, self.at] = np.where(np.abs(own) > self.margin, own, 0.0)
        return np.asarray(out)

    def missing(self, arm: Arm) -> Missing:
        said = listed(margin_rad=self.margin)
        return Missing("compliance_margin", ("dead_band",), of_joints(self, arm), said, "ROBOTIS, AX-12A e-Manual")


@dataclass(frozen=True)
class CommandPlay(Law):
    """The servo is told less than the whole way back."""

    width: Floats
    """(S,) whole [rad]."""

    def command(self, time_s: Floats, target: Floats) -> Floats:
        out, half = target.copy(), 0.5 * self.width
        held = target[:, 0, self.at]
        for t in range(target.shape[1]):
            held = np.clip(held, target[:, t, self.at] - half, target[:, t, self.at] + half)
            out[:, t, self.at] = held
        return np.asarray(out)

    def missing(self, arm: Arm) -> Missing:
        source = "Su et al. 2000, IEEE TAC 45(12)"
        return Missing("command_play", ("hysteresis",), of_joints(self, arm), listed(width_rad=self.width), source)


@dataclass(frozen=True)
class LineLatency(Law):
    """Commands come late; all joints are on one line."""

    late_s: float

    def command(self, time_s: Floats, target: Floats) -> Floats:
        late = np.clip(np.searchsorted(time_s, time_s - self.late_s + 1e-9, side="right") - 1, 0, None)
        return np.asarray(target[:, late])

    def missing(self, arm: Arm) -> Missing:
        classes = ("actuation_delay", "latency")
        return Missing("line_latency", classes, arm.joints, listed(late_s=self.late_s), "FTDI 2006, AN232B-04")


@dataclass(frozen=True)
class ProfileSpeed(Law):
    """Targets are neared at a highest speed."""

    fastest: Floats
    """(S,) [rad/s]"""

    def command(self, time_s: Floats, target: Floats) -> Floats:
        out, reached = target.copy(), target[:, 0, self.at]
        for t in range(1, target.shape[1]):
            most = self.fastest * (time_s[t] - time_s[t - 1])
            reached = reached + np.clip(target[:, t, self.at] - reached, -most, most)
            out[:, t, self.at] = reached
        return np.asarray(out)

    def missing(self, arm: Arm) -> Missing:
        classes = ("rate_limit", "velocity_saturation")
        said = listed(fastest_rad_s=self.fastest)
        return Missing("profile_speed", classes, of_joints(self, arm), said, "ROBOTIS, XL430-W250 e-Manual")


@dataclass(frozen=True)
class Smoothing(Law):
    """Targets go through two equal first-order filters."""

    constant_s: Floats
    """(S,) of each filter."""

    def command(self, time_s: Floats, target: Floats) -> Floats:
        out, step = target.copy(), float(time_s[1] - time_s[0])
        for j, constant in zip(self.sites, self.constant_s, strict=True):
            keep = np.exp(-step / constant)
            for _ in range(2):
                begin = keep * out[:, :1, j]
                out[:, :, j], _ = lfilter([1 - keep], [1, -keep], out[:, :, j], axis=1, zi=begin)
        return np.asarray(out)

    def missing(self, arm: Arm) -> Missing:
        classes = ("first_order_lag", "actuation_delay")
        said = listed(constant_s=self.constant_s)
        return Missing("smoothing", classes, of_joints(self, arm), said, "ROBOTIS, XL430-W250 e-Manual")

"""A made-up calibration of an arm: two joints, an inertial unit, and windows of 5 s of two long recordings."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from compass_ros.types import Gap, Replay, ReplayedTrack, Result, SignalGap

ERRORS_RAD = (0.002, 0.080, 0.010, 0.040)
"""Of the calibrated simulator: held out, fitted, held out, fitted."""
NAMES = ("sweep at 0.0 s", "ramp at 5.0 s", "sweep at 5.0 s", "ramp at 15.0 s")


def arm(result: Result) -> Result:
    """The same result with an arm's windows instead of its episodes."""
    replays = tuple(_window(*one) for one in zip(NAMES, (True, False, True, False), ERRORS_RAD, strict=True))
    signals = {
        "joints": SignalGap(0.02, "rad", 0.0005, {"elbow": 0.02, "wrist": 0.01}),
        "imu": SignalGap(0.1, "rad/s", 0.03),
    }
    gap: dict[Any, Any] = {
        m: {p: Gap({}, 0.02, signals) for p in ("fit", "held_out")} for m in ("nominal", "calibrated")
    }
    fit, held_out = NAMES[1::2], NAMES[::2]
    return replace(result, fit=fit, held_out=held_out, replays=replays, gap=gap, unit="rad", noise_floor_m=0.0005)


def _window(name: str, held_out: bool, error_rad: float) -> Replay:
    time = 0.01 + np.arange(100) / 20
    angle = 0.3 * np.sin(time)[:, None]
    joints = tuple(
        ReplayedTrack(f"joints.{joint}", time, turn * angle, turn * angle + 0.1, turn * angle + error_rad, None)
        for joint, turn in (("elbow", 1.0), ("wrist", -1.0))
    )
    turning = np.column_stack([np.cos(time), np.zeros((100, 2))])
    imu = ReplayedTrack("imu", time, turning, turning + 1e-3, turning + 1e-4, None)
    return Replay(name, held_out, (*joints, imu))

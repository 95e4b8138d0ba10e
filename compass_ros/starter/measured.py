"""What a signal's recordings say of its sensor: noise and step; and how far joints stay from their commands."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from compass_ros.calibration.noise import measure_noise
from compass_ros.starter.matching import Found
from compass_ros.starter.motion import Column
from compass_ros.types import Floats

_FRAMES = 4000
"""Of a recording that are looked at: enough for a per cent of a standard deviation."""
_EXPECTED = 1e-4
"""Noise where nothing shows it [any unit of SI]: a sensor of a robot is rarely better."""
_ALIKE = 0.02
"""Steps that differ by less are one."""


@dataclass(frozen=True)
class Sensor:
    """Of one signal."""

    noise: float
    """One standard deviation, rounding included: the median of its numbers, since a calibration measures each again."""
    step: float
    """What all its numbers count in; 0: none, or each in another."""
    rate_hz: float


def sensor(columns: Sequence[Sequence[Column]]) -> Sensor:
    """Of C columns in each of E recordings."""
    recordings = list(zip(*columns, strict=True))
    longest = min(max(len(c.value) for recording in recordings for c in recording), _FRAMES)
    value = np.full((len(recordings), longest, len(columns)), np.nan)
    for e, recording in enumerate(recordings):
        for c, column in enumerate(recording):
            own = column.value[:longest]
            value[e, : len(own), c] = own
    time = np.broadcast_to(np.arange(longest, dtype=float), value.shape[:2])
    found = measure_noise(time, value, _EXPECTED)
    steps = np.zeros(1) if found.step is None else found.step
    one = float(np.median(steps)) if np.ptp(steps) <= _ALIKE * steps.max() else 0.0
    gaps = np.concatenate([np.diff(c.stamp_ns) for c in columns[0]])
    rate = 1e9 / float(np.median(gaps)) if len(gaps) else 0.0
    return Sensor(float(np.median(found.sigma)), one, rate)


def command_errors(found: Found) -> dict[str, float]:
    """Median distance of each joint from its position command, with the lag taken out [rad or m]."""
    of = {m: one for one in found.measured for m in one.models}
    out = {}
    for command in found.commands:
        for joint, answer in command.lags.items():
            if command.kind == "position":
                pairs = zip(command.jointed.columns(joint), of[joint].columns(joint), strict=True)
                out[joint] = float(np.median([_error(c, a, answer.seconds, not command.linear) for c, a in pairs]))
    return out


def _error(command: Column, answer: Column, seconds: float, held: bool) -> float:
    late = answer.stamp_ns - round(seconds * 1e9)
    inside = (late >= command.stamp_ns[0]) & (late <= command.stamp_ns[-1])
    apart: Floats = np.abs(answer.value - command.at(late, held))[inside]
    return float(np.median(apart)) if len(apart) else 0.0

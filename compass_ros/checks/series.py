"""What the checks look at: one signal of one recording as plain numbers, with what its cell says of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from compass_ros.calibration.encoder import ROOT_12, encoder_step
from compass_ros.calibration.noise import LEAST_SHARE
from compass_ros.types import Bools, Floats, Ints

Kind = Literal["angle", "length", "orientation", "other"]
"""Of the numbers: of a hinge [rad], of a slide or a position [m], a quaternion (w, x, y, z), anything else."""

SIGMAS = 6.0
"""Normal noise is beyond so many standard deviations in two of 10^9 samples."""
_LAGS = (1, 2, 3)
_DIFFERENCES = (((1, -2, 1), 6.0), ((1, -4, 6, -4, 1), 70.0))
"""Second and fourth differences, with the sums of their squares: the fourth see less of a motion, and more of what
stands in between."""
_CALM = 0.2
"""This share of the smallest are those of noise, even where most samples are spoilt."""
_OF_NORMAL = 0.2533
"""The same quantile of the absolute value of a standard normal number."""


@dataclass(frozen=True)
class Series:
    """One signal in one recording."""

    recording: str
    signal: str
    kind: Kind
    stamp_ns: Ints
    """(F,) strictly increasing."""
    value: Floats
    """(F, C)."""
    low: float = -np.inf
    high: float = np.inf
    """What the scene lets it be [rad or m]."""

    @property
    def time_s(self) -> Floats:
        """(F,) since the first sample."""
        return np.asarray((self.stamp_ns - self.stamp_ns[0]) * 1e-9)

    @property
    def period_s(self) -> float:
        """Usual time between two samples; NaN for fewer than two."""
        return float(np.median(np.diff(self.stamp_ns))) * 1e-9 if len(self.stamp_ns) > 1 else float("nan")


@dataclass(frozen=True)
class Level:
    """How finely a signal says something, over all recordings of it."""

    noise: Floats
    """(C,) standard deviation of one sample."""
    step: Floats
    """(C,) of its encoder; 0: none found."""
    expected: float
    """Noise that the cell expects."""

    @property
    def apart(self) -> Floats:
        """(C,) distance from which two values differ by more than the noise, measured or expected."""
        return SIGMAS * np.maximum(self.noise, self.expected)


def level(series: Sequence[Series], expected: float, stated: float = 0.0) -> Level:
    """Noise and encoder of all recordings of one signal. `expected` [unit of the signal]: what the cell says of it.

    `stated`: step of an encoder by its cell, for one too fine to be found in the recordings; 0: none.
    """
    columns = [[one.value[:, c] for one in series] for c in range(series[0].value.shape[1])]
    least = LEAST_SHARE * expected
    step = np.array([encoder_step(column, ROOT_12 * least) or stated for column in columns])
    noise = np.array([difference_noise(column) for column in columns])
    return Level(np.maximum(noise, np.maximum(step / ROOT_12, least)), step, expected)


def difference_noise(series: Sequence[Floats]) -> float:
    """Standard deviation of white noise on smooth (F,) series, by the smaller ones of their differences.

    Also where other values stand in between: at one lag of three, neighbours are of one kind.
    """
    found = []
    for weights, gain in _DIFFERENCES:
        for lag in _LAGS:
            spaced = np.zeros(lag * (len(weights) - 1) + 1)
            spaced[::lag] = weights
            parts = [np.convolve(one, spaced, mode="valid") for one in series if len(one) >= len(spaced)]
            if parts:
                found.append(float(np.quantile(np.abs(np.concatenate(parts)), _CALM)) / (_OF_NORMAL * np.sqrt(gain)))
    return min(found, default=0.0)


def between(time: Floats, value: Floats, use: Bools) -> Floats:
    """(F, C) what the nearest used samples before and after each sample say, on the line through them.

    (F,) `use`: samples that may speak, a sample itself never for itself; at an end the nearest one is repeated.
    """
    used = np.flatnonzero(use)
    if not len(used):
        return np.full(value.shape, np.nan)
    before = np.searchsorted(used, np.arange(len(value))) - 1
    after = np.searchsorted(used, np.arange(len(value)), side="right")
    lone = np.clip(before, 0, len(used) - 1), np.clip(after, 0, len(used) - 1)
    first = used[np.where(before < 0, lone[1], lone[0])]
    last = used[np.where(after >= len(used), lone[0], lone[1])]
    span = time[last] - time[first]
    share = np.where(span > 0, (time - time[first]) / np.where(span > 0, span, 1.0), 0.0)[:, None]
    return np.asarray(value[first] + share * (value[last] - value[first]))

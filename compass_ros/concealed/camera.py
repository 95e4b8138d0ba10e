"""What lies between the motion and the recorded positions: clock, lens, shutter, tracker."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from compass_ros.concealed.law import Law, Places, Sample, Shape, nothing, sign
from compass_ros.types import Floats, Phase

_HALF_WIDTH = 0.225  # m
_PHASES: tuple[Phase, ...] = ("all", "free")


def _planar(seen: Floats) -> Floats:
    """(S, F, 2, 2) puck, xy."""
    return seen.reshape(*seen.shape[:2], 2, 2)


def _latency(size: float, shape: Shape, sample: Sample) -> Sample:
    return lambda time: sample(time - 0.005 * size)


LATENCY = Law(
    "camera_latency",
    "sensing",
    _PHASES,
    draw=nothing,
    camera=_latency,
    library=lambda size, shape: {"latency": 0.005 * size},
    most=40.0,
)


def _stretch(rng: Generator, places: Places, other: float) -> dict[str, float]:
    return {"hand": sign(rng), "unequal": other * float(rng.uniform(-0.1, 0.1))}


def _scale(size: float, shape: Shape, sample: Sample) -> Sample:
    """Height of the camera wrong; pixels not quite square."""
    factor = 1 + 0.005 * size * shape["hand"] * np.array([1 + shape["unequal"], 1 - shape["unequal"]] * 2)
    return lambda time: sample(time) * factor


SCALE = Law(
    "camera_scale",
    "sensing",
    _PHASES,
    draw=_stretch,
    camera=_scale,
    library=lambda size, shape: {"scale": 0.005 * size * shape["hand"]},
    most=20.0,
)


def _pivot(rng: Generator, places: Places, other: float) -> dict[str, float]:
    return {"hand": sign(rng), "x": other * float(rng.uniform(-0.1, 0.1)), "y": other * float(rng.uniform(-0.1, 0.1))}


def _rotation(size: float, shape: Shape, sample: Sample) -> Sample:
    """The camera turned about its axis, which does not meet the table at its centre."""
    angle = 0.005 * size * shape["hand"]
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    axis = np.array([shape["x"], shape["y"]])

    def turned(time: Floats) -> Floats:
        seen = sample(time)
        return np.asarray(((_planar(seen) - axis) @ turn.T + axis).reshape(seen.shape))

    return turned


ROTATION = Law(
    "camera_rotation",
    "sensing",
    _PHASES,
    draw=_pivot,
    camera=_rotation,
    library=lambda size, shape: {"angle": 0.005 * size * shape["hand"]},
    most=20.0,
)


def _glass(rng: Generator, places: Places, other: float) -> dict[str, float]:
    return {"hand": sign(rng), "k2": other * float(rng.uniform(-1.5, 1.5))}


def _lens(size: float, shape: Shape, sample: Sample) -> Sample:
    """Brown's radial distortion with two terms; k2 in shares of k1, 1/m^2."""

    def through(time: Floats) -> Floats:
        seen = _planar(sample(time))
        r2 = np.sum(seen**2, axis=3, keepdims=True)
        bent = 1 + 0.05 * size * shape["hand"] * (r2 + shape["k2"] * r2**2)
        return np.asarray((seen * bent).reshape(*seen.shape[:2], 4))

    return through


LENS = Law("lens_distortion", "sensing", _PHASES, draw=_glass, camera=_lens, most=8.0)


def _rows(rng: Generator, places: Places, other: float) -> dict[str, float]:
    return {"hand": sign(rng)}


def _shutter(size: float, shape: Shape, sample: Sample) -> Sample:
    """Rows along the table are read one after another; the row is the one in which the puck is when it is read."""

    def read(time: Floats) -> Floats:
        line = 0.005 * size * shape["hand"] / _HALF_WIDTH
        out = np.empty((*time.shape, 4))
        for puck in (0, 1):
            own = slice(2 * puck, 2 * puck + 2)
            row = sample(time)[..., 2 * puck + 1]
            for _ in range(2):
                row = sample(time + line * row)[..., 2 * puck + 1]
            out[..., own] = sample(time + line * row)[..., own]
        return out

    return read


SHUTTER = Law(
    "rolling_shutter",
    "sensing",
    _PHASES,
    draw=_rows,
    camera=_shutter,
    library=lambda size, shape: {"y": 0.005 * size * shape["hand"] / _HALF_WIDTH},
    most=10.0,
)


def _average(size: float, shape: Shape, sample: Sample) -> Sample:
    """A moving average over the last `size` times 10 ms."""
    back = 0.01 * size * (np.arange(16) + 0.5) / 16
    return lambda time: np.asarray(np.mean([sample(time - lag) for lag in back], axis=0))


LAG = Law(
    "tracking_lag",
    "sensing",
    _PHASES,
    draw=nothing,
    camera=_average,
    library=lambda size, shape: {"time": 0.005 * size, "spread": 3**-0.5},
    most=20.0,
)


def _quartz(rng: Generator, places: Places, other: float) -> dict[str, float]:
    return {"hand": sign(rng), "warming": other * float(rng.uniform(-0.2, 0.2))}


def _drift(size: float, shape: Shape, sample: Sample) -> Sample:
    """A clock whose rate error changes a little while it warms."""
    rate = 0.005 * size * shape["hand"]
    return lambda time: sample(time * (1 + rate * (1 + shape["warming"] * (time / 2.5 - 0.5))))


DRIFT = Law(
    "clock_drift",
    "sensing",
    _PHASES,
    draw=_quartz,
    camera=_drift,
    library=lambda size, shape: {"rate": 0.005 * size * shape["hand"]},
    most=10.0,
)

LAWS = (LATENCY, SCALE, ROTATION, LENS, SHUTTER, LAG, DRIFT)

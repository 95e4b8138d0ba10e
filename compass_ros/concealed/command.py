"""What lies between the command and the motion of the arm."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator
from scipy.signal import lfilter

from compass_ros.concealed.law import Law, Places, Shape, nothing, sign
from compass_ros.types import Floats


def _speed(command: Floats) -> Floats:
    return np.asarray(np.linalg.norm(command, axis=2, keepdims=True))


def _delay(size: float, shape: Shape, command: Floats, dt: float) -> Floats:
    """The whole command, later by `size` times 5 ms."""
    time = dt * np.arange(command.shape[1])
    late = time - 0.005 * size
    return np.stack([np.stack([np.interp(late, time, axis, left=0.0) for axis in shot.T], axis=1) for shot in command])


DELAY = Law(
    "actuation_delay",
    "actuation",
    ("strike", "all"),
    draw=nothing,
    command=_delay,
    library=lambda size, shape: {"delay": 0.005 * size},
    most=50.0,
)


def _damped(rng: Generator, places: Places, other: float) -> dict[str, float]:
    return {"second": other * float(rng.uniform(0.05, 0.25))}


def _lag(size: float, shape: Shape, command: Floats, dt: float) -> Floats:
    """A servo of second order, overdamped: one slow and one fast pole, one after the other."""
    followed = command
    for time in (0.005 * size, 0.005 * size * shape["second"]):
        keep = np.exp(-dt / time) if time > 0 else 0.0
        followed = lfilter([1 - keep], [1, -keep], followed, axis=1)
    return np.asarray(followed)


LAG = Law(
    "first_order_lag",
    "actuation",
    ("strike", "all"),
    draw=_damped,
    command=_lag,
    library=lambda size, shape: {"time": 0.005 * size * (1 + shape["second"])},
    most=40.0,
)


def _edge(rng: Generator, places: Places, other: float) -> dict[str, float]:
    return {"power": 8.0 + other * 22.0}


def _saturation(size: float, shape: Shape, command: Floats, dt: float) -> Floats:
    """A hard limit, its corner slightly rounded. Size 1: 1 m/s; the limit falls as the size grows."""
    speed, power = _speed(command), shape["power"]
    return np.asarray(command / (1 + (speed * size) ** power) ** (1 / power))


SATURATION = Law(
    "velocity_saturation",
    "actuation",
    ("strike", "all"),
    draw=_edge,
    command=_saturation,
    library=lambda size, shape: {"inverse_limit": size, "sharpness": shape["power"]},
    first=2.0,
    most=10.0,
)


def _corner(rng: Generator, places: Places, other: float) -> dict[str, float]:
    return {"softness": other * 0.15}


def _dead_band(size: float, shape: Shape, command: Floats, dt: float) -> Floats:
    """A speed that friction in the drive takes away, with a soft corner."""
    speed, band = _speed(command), 0.003 * size
    width = shape["softness"] * band
    left = np.maximum(speed - band, 0) if width == 0 else width * np.logaddexp(0, (speed - band) / max(width, 1e-12))
    return np.asarray(command * np.minimum(left / np.maximum(speed, 1e-12), 1))


DEAD_BAND = Law(
    "dead_band",
    "actuation",
    ("strike", "all"),
    draw=_corner,
    command=_dead_band,
    library=lambda size, shape: {"band": 0.003 * size},
    most=45.0,
)


def _bent(rng: Generator, places: Places, other: float) -> dict[str, float]:
    return {"hand": sign(rng), "with_speed": other * float(rng.uniform(-0.3, 0.3))}


def _heading(size: float, shape: Shape, command: Floats, dt: float) -> Floats:
    """A push beside the commanded line, a little more or less so when fast."""
    top = _speed(command).max(axis=1, keepdims=True)
    angle = 0.002 * size * shape["hand"] * (1 + shape["with_speed"] * (top / 0.4 - 1))[:, :, 0]
    cos, sin = np.cos(angle), np.sin(angle)
    return np.stack([cos * command[..., 0] - sin * command[..., 1], sin * command[..., 0] + cos * command[..., 1]], 2)


HEADING = Law(
    "heading_bias",
    "actuation",
    ("strike", "all"),
    draw=_bent,
    command=_heading,
    library=lambda size, shape: {"angle": 0.002 * size * shape["hand"]},
    most=80.0,
)


def _scatter(rng: Generator, places: Places, other: float) -> dict[str, float]:
    return {f"shot_{i}": float(rng.standard_normal()) for i in range(places.shots)}


def _jitter(size: float, shape: Shape, command: Floats, dt: float) -> Floats:
    """Each push faster or slower by its own share."""
    share = 0.005 * size * np.array([shape[f"shot_{i}"] for i in range(len(command))])
    return np.asarray(command * (1 + share[:, None, None]))


JITTER = Law("stroke_jitter", "actuation", ("strike", "all"), draw=_scatter, command=_jitter, most=40.0)

LAWS = (DELAY, LAG, SATURATION, DEAD_BAND, HEADING, JITTER)

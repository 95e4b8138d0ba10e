"""Pushes that depend on the place: a table out of level, a draught, jets of a fan, a vortex, a magnet."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from compass_ros.concealed.law import Law, Moment, Places, Shape, sign, spot
from compass_ros.types import Floats

G = 9.81  # m/s^2
_HALF_WIDTH = 0.225  # m


def _slope(rng: Generator, places: Places, other: float) -> dict[str, float]:
    angle = rng.uniform(0, 2 * np.pi)
    return {"x": float(np.cos(angle)), "y": float(np.sin(angle)), "warp": other * float(rng.uniform(-0.15, 0.15))}


def _tilt(size: float, shape: Shape, at: Moment) -> Floats:
    """The weight along a slope of `size` milliradians, a little steeper at one end of the table."""
    slope = 1e-3 * size * (1 + shape["warp"] * at.position[:, :, 0] / 0.45)
    return np.asarray((at.mass * G * slope)[:, :, None] * np.array([shape["x"], shape["y"]]))


TILT = Law("table_tilt", "dynamics", ("free",), draw=_slope, force=_tilt)


def _draught(rng: Generator, places: Places, other: float) -> dict[str, float]:
    angle = rng.uniform(0, 2 * np.pi)
    return {
        "x": float(np.cos(angle)),
        "y": float(np.sin(angle)),
        "air_speed": float(rng.uniform(0.6, 1.5)),
        "profile": other * float(rng.uniform(0.05, 0.15)),
    }


def _crosswind(size: float, shape: Shape, at: Moment) -> Floats:
    """Drag against moving air that is slower at the wall it comes from: a logarithmic profile of a boundary layer."""
    along = np.array([shape["x"], shape["y"]])
    fetch = np.clip(at.position @ along / 0.5 + 1.0, 0.02, 2.0)  # 0 where the air enters, 1 in the middle
    air = shape["air_speed"] * (1 + shape["profile"] * np.log(fetch))[:, :, None] * along
    relative = air - at.velocity
    pull = 0.01 * size * np.linalg.norm(relative, axis=2) / shape["air_speed"] ** 2
    return np.asarray((at.mass * pull)[:, :, None] * relative)


CROSSWIND = Law("crosswind", "dynamics", ("free",), draw=_draught, force=_crosswind)


def _jets(rng: Generator, places: Places, other: float) -> dict[str, float]:
    count = int(rng.integers(5, 10))
    shape = spot(rng, places) | {"radius": float(rng.uniform(0.05, 0.14)), "jets": float(count), "spread": other * 0.35}
    for i in range(count):
        angle = 2 * np.pi * (i + other * rng.uniform(-0.2, 0.2)) / count
        shape |= {f"angle_{i}": float(angle), f"share_{i}": float(1 + other * rng.uniform(-0.3, 0.3))}
    return shape


def _fan(size: float, shape: Shape, at: Moment) -> Floats:
    """A bundle of jets on a ring; each pushes away from its own foot."""
    count, radius = int(shape["jets"]), shape["radius"]
    total = np.zeros_like(at.position)
    width = radius * np.sqrt(1 - 0.5 * shape["spread"] ** 2)  # the feet lie apart: narrower jets give the same bundle
    for i in range(count):
        foot = np.array([np.cos(shape[f"angle_{i}"]), np.sin(shape[f"angle_{i}"])]) * shape["spread"] * radius
        arm = at.position - np.array([shape["centre_x"], shape["centre_y"]]) - foot
        r2 = np.sum(arm**2, axis=2, keepdims=True)
        total += shape[f"share_{i}"] / count * arm / width * np.exp(0.5 * (1 - r2 / width**2))
    return np.asarray(0.03 * size * at.mass[None, :, None] * total)


FAN = Law("fan_field", "dynamics", ("free",), draw=_jets, force=_fan)


def _vortex_shape(rng: Generator, places: Places, other: float) -> dict[str, float]:
    return spot(rng, places) | {"radius": float(rng.uniform(0.05, 0.12)), "hand": sign(rng), "lamb_oseen": other}


def _swirl(size: float, shape: Shape, at: Moment) -> Floats:
    """Lamb-Oseen: speed (1 - exp(-a r^2 / radius^2)) / r, peak at `radius`, long tail; at lamb_oseen 0 a short tail."""
    arm = at.position - np.array([shape["centre_x"], shape["centre_y"]])
    ratio2 = np.sum(arm**2, axis=2) / shape["radius"] ** 2
    peaked = np.exp(0.5 * (1 - ratio2))
    long_tail = -np.expm1(-1.25643 * ratio2) / np.maximum(ratio2, 1e-9) / 0.71533
    turn = shape["lamb_oseen"] * long_tail + (1 - shape["lamb_oseen"]) * peaked
    around = np.stack([-arm[:, :, 1], arm[:, :, 0]], axis=2) / shape["radius"]
    return np.asarray(0.03 * size * shape["hand"] * (at.mass * turn)[:, :, None] * around)


SWIRL = Law("swirl", "dynamics", ("free",), draw=_vortex_shape, force=_swirl)


def _magnet_shape(rng: Generator, places: Places, other: float) -> dict[str, float]:
    return spot(rng, places) | {
        "depth": float(rng.uniform(0.05, 0.12)),
        "power": 3.0 + other * float(rng.uniform(0, 1)),
    }


def _attraction(size: float, shape: Shape, at: Moment) -> Floats:
    """A magnet under the table: inverse power of the distance, softened by its depth; its peak depends on neither."""
    arm = at.position - np.array([shape["centre_x"], shape["centre_y"]])
    power, depth = shape["power"], shape["depth"]
    peak = (1 / (power - 1)) ** 0.5 * (1 + 1 / (power - 1)) ** (-0.5 * power)  # of u / (1 + u^2)^(power / 2)
    u2 = np.sum(arm**2, axis=2) / depth**2
    pull = 0.03 * size / peak / depth * (1 + u2) ** (-0.5 * power)
    return np.asarray(-(at.mass * pull)[:, :, None] * arm)


ATTRACTION = Law("point_attraction", "dynamics", ("free",), draw=_magnet_shape, force=_attraction)

LAWS = (TILT, CROSSWIND, FAN, SWIRL, ATTRACTION)

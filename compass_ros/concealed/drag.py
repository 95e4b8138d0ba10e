"""Forces along or across the motion of a puck: air drag with odd exponents, and the push on a spinning puck."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from compass_ros.concealed.law import Law, Moment, Places, Shape
from compass_ros.types import Floats


def _power(rng: Generator, places: Places, other: float, low: float, high: float, like: float) -> dict[str, float]:
    return {"exponent": like + other * (float(rng.uniform(low, high)) - like)}


def _drag(scale: float, size: float, shape: Shape, at: Moment) -> Floats:
    """|F| = m size scale (v / 0.4 m/s)^(exponent - 1) v: exponents are compared at a middling speed."""
    pace = np.maximum(at.speed, 1e-6) / 0.4
    rate = size * scale * pace ** (shape["exponent"] - 1)
    return -(at.mass * rate)[:, :, None] * at.velocity


VISCOUS = Law(
    name="viscous_drag",
    channel="dynamics",
    phases=("free",),
    draw=lambda rng, places, other: _power(rng, places, other, 1.0, 1.1, 1.0),
    on="puck",
    force=lambda size, shape, at: _drag(0.02, size, shape, at),
)

QUADRATIC = Law(
    name="quadratic_drag",
    channel="dynamics",
    phases=("free",),
    draw=lambda rng, places, other: _power(rng, places, other, 1.8, 2.1, 2.0),
    on="puck",
    force=lambda size, shape, at: _drag(0.04, size, shape, at),
)


def _spin(rng: Generator, places: Places, other: float) -> dict[str, float]:
    return {"hand": float(rng.choice((-1.0, 1.0))), "decay": other * float(rng.uniform(0.0, 0.1))}


def _magnus(size: float, shape: Shape, at: Moment) -> Floats:
    """Across the motion, in proportion to a spin that the air slows."""
    rate = 0.02 * size * shape["hand"] * np.exp(-shape["decay"] * at.time)
    across = np.stack([-at.velocity[:, :, 1], at.velocity[:, :, 0]], axis=2)
    return np.asarray(rate * at.mass[None, :, None] * across)


MAGNUS = Law("magnus", "dynamics", ("free",), draw=_spin, on="puck", force=_magnus)

LAWS = (VISCOUS, QUADRATIC, MAGNUS)

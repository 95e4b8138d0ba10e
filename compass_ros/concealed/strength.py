"""How large a law has to be, and what else could have done the same."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from compass_ros.concealed.absorption import NOISE, Absorber, rms
from compass_ros.concealed.law import PUCKS, Ingredient, Places
from compass_ros.concealed.laws import KNOWN
from compass_ros.concealed.table import Played, Table
from compass_ros.types import Floats

_CLOSE = 0.05
"""A size is right when the rms is this near, relatively."""
_PLAYS = 9
_SIMPLE = (
    *("table_tilt", "viscous_drag", "quadratic_drag", "magnus", "friction_gradient", "anisotropic_friction"),
    *("actuation_delay", "first_order_lag", "velocity_saturation", "dead_band", "heading_bias"),
    *("camera_latency", "camera_scale", "camera_rotation", "lens_distortion", "rolling_shutter", "tracking_lag"),
    "clock_drift",
)
"""Laws that are no more than an amount, or an amount in two directions: those that can be each other's twins."""
_TOLD_APART = 3.0
"""Log likelihood that another law must lose before recordings tell it apart."""
TWIN_COSINE = 0.99
"""Twins leave less than 14 % of each other: less than the other functional forms of these worlds differ."""


@dataclass(frozen=True)
class Judge:
    """Shots of a world played without any law, and what parameters would absorb of a change."""

    table: Table
    absorber: Absorber
    time_s: Floats
    """(S, F) [s]."""
    base: Played

    def change(self, ingredients: Sequence[Ingredient]) -> Floats:
        """(S, F, 4) what laws move [m]."""
        moved = any(i.law.channel != "sensing" for i in ingredients)
        sample = (self.table.play(ingredients) if moved else self.base).sample()
        for i in ingredients:
            if i.law.camera is not None:
                sample = i.law.camera(i.size, i.shape, sample)
        return np.asarray(sample(self.time_s) - self.base.sample()(self.time_s))


@dataclass(frozen=True)
class Strength:
    """A sized ingredient and what it does."""

    ingredient: Ingredient
    change: Floats
    """(S, F, 4) [m]."""
    left: Floats
    """(S, F, 4) what is left after the best parameters [m]."""

    @property
    def rms_m(self) -> float:
        return rms(self.left)


def sized(ingredient: Ingredient, judge: Judge, target: float) -> Strength:
    """Scale the law until what parameters leave of it is `target` rms [m]; nearest where its bounds end before."""
    low, high = 0.0, np.inf
    size = ingredient.law.first
    best: Strength | None = None
    for _ in range(_PLAYS):
        tried = replace(ingredient, size=size)
        change = judge.change([tried])
        found = Strength(tried, change, judge.absorber.left(change))
        if best is None or abs(found.rms_m - target) < abs(best.rms_m - target):
            best = found
        if abs(found.rms_m / target - 1) < _CLOSE or (found.rms_m < target and size >= ingredient.law.most):
            break
        low, high = (size, high) if found.rms_m < target else (low, size)
        size = _next(size, found.rms_m / target, low, high, ingredient.law.most)
    assert best is not None
    return best


def _next(size: float, ratio: float, low: float, high: float, most: float) -> float:
    """In proportion, but inside of what is known to be too small and too large."""
    wanted = size / float(np.clip(ratio, 0.1, 10.0))
    if low < wanted < min(high, most):
        return wanted
    return min(most, 0.5 * (low + high)) if np.isfinite(high) else most


def twins(strength: Strength, judge: Judge) -> dict[str, float]:
    """Other known laws that would have done the same after the best parameters, with their cosine.

    Fitted freely, along two directions where a law has two. Camera latency and actuation delay are the same thing
    wherever the pusher is not tracked. Laws with a shape of their own (a field, a patch) have no twins here.
    """
    own = strength.ingredient.law.name
    if own not in (*_SIMPLE, "crosswind"):
        return {}
    left, out = strength.left.ravel(), {}
    for name in _SIMPLE:
        if name == own:
            continue
        design = np.stack([judge.absorber.left(change).ravel() for change in _tangents(name, judge)], axis=1)
        fitted = design @ np.linalg.lstsq(design, left, rcond=None)[0]
        loss = 0.5 * float(np.sum((left - fitted) ** 2)) / NOISE**2
        cosine = float(np.linalg.norm(fitted) / np.linalg.norm(left))
        if cosine > TWIN_COSINE or loss < _TOLD_APART:
            out[name] = cosine
    return out


def _tangents(name: str, judge: Judge) -> list[Floats]:
    """Changes by a small amount of a law in the library's own form, one for each of its directions."""
    law = KNOWN[name]
    places = Places(np.zeros((1, 2)), {}, len(judge.time_s))
    plain = law.draw(np.random.default_rng(0), places, 0.0)
    shapes: list[dict[str, float]] = [plain]
    if "axis" in plain:
        shapes = [plain | {"axis": angle} for angle in (0.0, 0.25 * np.pi)]
    elif {"x", "y"} <= plain.keys() and name != "camera_rotation":
        shapes = [plain | {"x": 1.0, "y": 0.0}, plain | {"x": 0.0, "y": 1.0}]
    return [_modest(Ingredient(law, PUCKS, shape, law.first), judge) for shape in shapes]


def _modest(ingredient: Ingredient, judge: Judge) -> Floats:
    """The change at a size at which it is neither lost nor bent."""
    for _ in range(4):
        change = judge.change([ingredient])
        if 0.5e-3 < rms(change) < 5e-3:
            break
        ratio = float(np.clip(rms(change) / 2e-3, 0.5, 20.0))
        ingredient = replace(ingredient, size=min(ingredient.size / ratio, ingredient.law.most))
    return change

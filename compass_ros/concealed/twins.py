"""What else could have done the same: the class of an effect, from the physics of its own world."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from compass_ros.concealed.absorption import NOISE, rms
from compass_ros.concealed.law import PUCKS, Ingredient, Places
from compass_ros.concealed.laws import KNOWN
from compass_ros.concealed.strength import Judge, Strength
from compass_ros.types import Floats

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
_WORTH_A_LOOK = 0.5
"""Cosine from which a small amount is tried at its full size: a small latency is to one of 46 ms as 0.80."""
_ROUNDS = 3


@dataclass(frozen=True)
class _Match:
    """The best that another law can do."""

    cosine: float
    loss: float
    """Log likelihood that it leaves."""


def twins(strength: Strength, judge: Judge) -> dict[str, float]:
    """Other known laws that would have done the same after the best parameters, with their cosine.

    Camera latency and actuation delay are the same thing wherever the pusher is not tracked. Laws with a shape of their
    own (a field, a patch) have no twins here.
    """
    own = strength.ingredient.law.name
    if own not in (*_SIMPLE, "crosswind"):
        return {}
    matches = {name: _match(name, strength.left.ravel(), judge) for name in _SIMPLE if name != own}
    return {
        name: match.cosine
        for name, match in matches.items()
        if match and (match.cosine > TWIN_COSINE or match.loss < _TOLD_APART)
    }


def _match(name: str, left: Floats, judge: Judge) -> _Match | None:
    """Fit a law freely, along two directions where it has two; None where only a negative amount would do.

    What a law does is not quite in proportion to its size, so that a good match is looked at again at its own size.
    """
    parts = [_modest(part, judge) for part in _directions(name, len(judge.time_s))]
    best: _Match | None = None
    for _ in range(_ROUNDS):
        design = np.stack([judge.absorber.left(judge.change([part])).ravel() for part in parts], axis=1)
        amounts = np.linalg.lstsq(design, left, rcond=None)[0]
        fitted = design @ amounts
        loss = 0.5 * float(np.sum((left - fitted) ** 2)) / NOISE**2 / judge.repeated
        found = _Match(float(np.linalg.norm(fitted) / np.linalg.norm(left)), loss)
        whole = _combined(parts, amounts)
        if whole is None:
            return best
        best = found if best is None or found.cosine > best.cosine else best
        if found.cosine < _WORTH_A_LOOK:
            break
        parts = [whole]
    return best


def _directions(name: str, shots: int) -> list[Ingredient]:
    """A small amount of a law in the library's own form, once for each of its directions."""
    law = KNOWN[name]
    plain = law.draw(np.random.default_rng(0), Places(np.zeros((1, 2)), {}, shots), 0.0)
    shapes: list[dict[str, float]] = [plain]
    if "axis" in plain:
        shapes = [plain | {"axis": angle} for angle in (0.0, 0.25 * np.pi)]
    elif {"x", "y"} <= plain.keys() and "hand" not in plain:
        shapes = [plain | {"x": 1.0, "y": 0.0}, plain | {"x": 0.0, "y": 1.0}]
    return [Ingredient(law, PUCKS, shape, law.first) for shape in shapes]


def _combined(parts: Sequence[Ingredient], amounts: Floats) -> Ingredient | None:
    """One ingredient for amounts of its directions; None where an amount would have to be negative and cannot be."""
    first = parts[0]
    if len(parts) == 2:
        x, y = (float(part.size * amount) for part, amount in zip(parts, amounts, strict=True))
        if "axis" in first.shape:
            return replace(first, size=float(np.hypot(x, y)), shape={**first.shape, "axis": 0.5 * np.arctan2(y, x)})
        size = float(np.hypot(x, y)) or 1e-12
        return replace(first, size=size, shape={**first.shape, "x": x / size, "y": y / size})
    amount = float(amounts[0])
    if amount > 0:
        return replace(first, size=min(first.size * amount, first.law.most))
    if "hand" not in first.shape:
        return None
    return replace(first, size=-first.size * amount, shape={**first.shape, "hand": -first.shape["hand"]})


def _modest(ingredient: Ingredient, judge: Judge) -> Ingredient:
    """At a size at which it is neither lost nor bent."""
    for _ in range(4):
        moved = rms(judge.change([ingredient]))
        if 0.5e-3 < moved < 5e-3:
            break
        ratio = float(np.clip(moved / 2e-3, 0.5, 20.0))
        ingredient = replace(ingredient, size=min(ingredient.size / ratio, ingredient.law.most))
    return ingredient

"""How large a law has to be to move the pucks by so much."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from compass_ros.concealed.absorption import Absorber, rms
from compass_ros.concealed.law import Ingredient
from compass_ros.concealed.table import Played, Table
from compass_ros.types import Floats

_CLOSE = 0.05
"""A size is right when the rms is this near, relatively."""
_PLAYS = 9


@dataclass(frozen=True)
class Judge:
    """Shots of a world played without any law, and what parameters would absorb of a change."""

    table: Table
    absorber: Absorber
    time_s: Floats
    """(S, F) [s]."""
    base: Played
    repeated: float = 1.0
    """Frames that one independent measurement is worth, by the noise of the recordings."""

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
    """(S, F, 4) what is left after the best parameters [m], to first order: to compare laws with."""
    rms_m: float
    """Of what is left when the parameters really move."""


def sized(ingredient: Ingredient, judge: Judge, target: float) -> Strength:
    """Scale the law until what parameters leave of it is `target` rms [m]; nearest where its bounds end before."""
    low, high = 0.0, np.inf
    size = ingredient.law.first
    best: Strength | None = None
    for _ in range(_PLAYS):
        tried = replace(ingredient, size=size)
        change, absorber = judge.change([tried]), judge.absorber
        found = Strength(tried, change, absorber.left(change), rms(absorber.really_left(change)))
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

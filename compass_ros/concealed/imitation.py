"""How near the library's formula of an effect can come to a law of this world, in the trajectories.

A fit sees what the best parameters leave of a change. So the ideal numbers of a formula are those that leave least of
the law there; what they leave says how far the law is from the formula.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from compass_ros.concealed.absorption import NOISE, rms
from compass_ros.concealed.law import Ingredient, Law, Places, nothing
from compass_ros.concealed.laws import KNOWN
from compass_ros.concealed.library import FORMS, along
from compass_ros.concealed.strength import Judge, Strength
from compass_ros.concealed.table import Played
from compass_ros.types import Floats

_EVALUATIONS = 5
"""Points at which differences are taken at most; each costs as many plays as the formula has numbers."""
_STEP = 0.02
"""Of differences, in the size of a number."""
_ROBUST = 4.0
"""Scale of the loss [noise]: what grows without limit after an unlucky collision counts in proportion."""
_DRAWS, _FOLLOWED = 2, 3
"""Drawn shapes from which each formula starts to imitate a law from outside, beside the law's own place and size; how
many formulas are compared in trajectories."""


@dataclass(frozen=True)
class Imitation:
    """A formula at its best."""

    name: str
    numbers: Mapping[str, float]
    left_m: float
    """What it leaves of the law after the best parameters, rms [m]."""


def ideal(strength: Strength, judge: Judge, played: Played) -> Imitation | None:
    """The library's formula of the same effect; None for one that is not a formula of forces, or of the lens."""
    law = strength.ingredient.law
    if law.name == "lens_distortion":
        k1 = 0.05 * strength.ingredient.size * strength.ingredient.shape["hand"]
        return _nearest(law.name, ("k1",), np.array([k1]), _lens, {}, strength, judge)
    if law.name not in FORMS:
        return None
    form = FORMS[law.name]
    start, _ = along(strength.ingredient, strength.ingredient, form, judge.table, played)
    return _by_force(law.name, start, strength, judge)


def best_imitation(strength: Strength, judge: Judge, places: Places, played: Played) -> Imitation:
    """The formula of forces that comes nearest to a law from outside the library."""
    rng = np.random.default_rng(0)
    starts = []
    own = strength.ingredient.shape
    for name, form in FORMS.items():
        drawn = [KNOWN[name].draw(rng, places, 0.0) for _ in range(_DRAWS)]
        there = {**drawn[0], **{key: own[key] for key in drawn[0] if key in own}}
        for shape in (*drawn, there):
            like = Ingredient(KNOWN[name], strength.ingredient.objects, shape)
            numbers, left = along(strength.ingredient, like, form, judge.table, played, coarse=True)
            starts.append((left, name, numbers))
    nearest: dict[str, Floats] = {}
    for _, name, numbers in sorted(starts, key=lambda start: start[0]):
        nearest.setdefault(name, numbers)
    followed = list(nearest.items())[:_FOLLOWED]
    return min((_by_force(name, q, strength, judge) for name, q in followed), key=lambda found: found.left_m)


def _lens(q: Floats) -> list[Ingredient]:
    return [Ingredient(KNOWN["lens_distortion"], shape={"hand": 1.0, "k2": 0.0}, size=float(q[0]) / 0.05)]


def _by_force(name: str, start: Floats, strength: Strength, judge: Judge) -> Imitation:
    form, objects = FORMS[name], strength.ingredient.objects

    def pushing(q: Floats) -> list[Ingredient]:
        law = Law(name, "dynamics", ("free",), draw=nothing, force=lambda size, shape, at: form.formula(q, at))
        return [Ingredient(law, objects)]

    return _nearest(name, form.names, start, pushing, form.bounds, strength, judge)


def _nearest(
    name: str,
    names: tuple[str, ...],
    start: Floats,
    made: Callable[[Floats], list[Ingredient]],
    bounds: Mapping[str, tuple[float, float]],
    strength: Strength,
    judge: Judge,
) -> Imitation:
    """Least squares on what parameters leave of the difference of law and formula."""
    scale = np.maximum(np.abs(start), 0.02 * np.abs(start).max())
    low, high = np.array([bounds.get(n, (-np.inf, np.inf)) for n in names]).T

    def left(x: Floats) -> Floats:
        change = judge.change(made(start + scale * (x - 1)))
        return np.asarray(judge.absorber.left(change) - strength.left)

    found = least_squares(
        lambda x: left(x).ravel() / NOISE,
        np.ones(len(start)),
        bounds=(1 + (low - start) / scale, 1 + (high - start) / scale),
        loss="soft_l1",
        f_scale=_ROBUST,
        diff_step=_STEP,
        max_nfev=_EVALUATIONS,
    )
    numbers = start + scale * (found.x - 1)
    return Imitation(name, dict(zip(names, numbers.tolist(), strict=True)), rms(left(found.x)))

"""Which laws of a model are physics of their own, and which stand for what the form of the others lacks.

A law is a formula, and nature's is another one: a discrepancy in proportion to it, up to `RHO`, is expected of every
law and is no physics of its own. Where laws leave no more than such a share of what they change, a further one that
pushes only where they push is that discrepancy, written by other means: unless it takes all that they leave above the
noise, for the rest of a form is seldom a formula of the library itself. It stays in the simulator, where it is worth
its evidence, and is not named.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from compass_ros.discovery.evidence import log_sum
from compass_ros.discovery.fits import without
from compass_ros.discovery.hypothesis import Hypothesis, name_of
from compass_ros.discovery.settings import AT_NOISE, RHO
from compass_ros.simulation.effects import Attached

Weighed = tuple[Hypothesis, float]
"""A model and its log posterior odds."""


def told_apart(models: Mapping[str, Weighed], least: float) -> list[Weighed]:
    """Models by name, those that name the same laws as one: its most probable member, with the odds of all.

    Models below `least` log odds keep all their laws.
    """
    groups: dict[frozenset[tuple[str, tuple[str, ...]]], list[Weighed]] = {}
    for model, odds in models.values():
        said = replace(model, corrections=_corrections(model, models)) if odds >= least else model
        key = frozenset((a.effect.name, a.objects) for a in said.physics)
        groups.setdefault(key, []).append((said, odds))
    merged: list[Weighed] = []
    for group in groups.values():
        best, _ = max(group, key=lambda weighed: weighed[1])
        merged.append((best, log_sum(np.array([odds for _, odds in group]))))
    return sorted(merged, key=lambda weighed: -weighed[1])


def _corrections(model: Hypothesis, models: Mapping[str, Weighed]) -> tuple[Attached, ...]:
    """Laws of a model that correct the form of its others, the least of them first as long as there are any."""
    kept = model
    while less := _less(kept, models):
        kept = less
    return tuple(a for a in model.laws if a not in kept.laws)


def _less(model: Hypothesis, models: Mapping[str, Weighed]) -> Hypothesis | None:
    """The model without one of its laws that corrects the others, those that leave least; None: without any."""
    names = dict.fromkeys(a.effect.name for a in model.laws)
    found: list[tuple[float, Hypothesis]] = []
    for name in names if len(names) > 1 else ():
        own = [a for a in model.laws if a.effect.name == name]
        others = [a for a in model.laws if a.effect.name != name]
        pushed = model.sizes_of(own) > 0
        if not np.any(pushed) or np.any(model.sizes_of(others)[pushed] == 0):
            continue  # a scatter has no form, and what acts elsewhere corrects nothing
        known = models.get(name_of(others))
        rest = known[0] if known else without(model, own)
        if model.chi_square > AT_NOISE or rest.chi_square <= AT_NOISE:
            found.append((left_over(rest), rest))
    if not found:
        return None
    left, less = min(found, key=lambda pair: pair[0])
    return less if left <= max(RHO) else None


def left_over(model: Hypothesis) -> float:
    """What the laws of a model leave above the noise, as a share of what they change: rms of all that is measured."""
    likelihood = model.likelihood
    above = max(2 * model.fit.point.cost - likelihood.measurements, 0.0)
    changed = float(np.linalg.norm(model.bare - model.fit.linear.residual))
    return float(np.sqrt(above)) / changed if changed > 0 else np.inf

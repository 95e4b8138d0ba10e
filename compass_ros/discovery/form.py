"""Which laws of a model are physics of their own, and which stand for what the form of the others lacks.

A law is a formula, and nature's is another one: a discrepancy in proportion to it, up to `RHO`, is expected of every
law and is no physics of its own. A further law that changes the recordings by no more than such a share of what the
others change, and pushes only where they push, is that discrepancy, written by other means. It stays in the simulator,
where it is worth its evidence, and is not named.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from compass_ros.discovery.evidence import log_sum
from compass_ros.discovery.fits import without
from compass_ros.discovery.hypothesis import Hypothesis, name_of
from compass_ros.discovery.settings import RHO
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
    """The model without the law that changes least, where that one corrects the others; None: where none does."""
    names = dict.fromkeys(a.effect.name for a in model.laws)
    if len(names) < 2:
        return None
    found: list[tuple[float, Hypothesis]] = []
    for name in names:
        own = [a for a in model.laws if a.effect.name == name]
        others = [a for a in model.laws if a.effect.name != name]
        pushed = model.sizes_of(own) > 0
        if not np.any(pushed) or np.any(model.sizes_of(others)[pushed] == 0):
            continue  # a scatter has no form, and what acts elsewhere corrects nothing
        known = models.get(name_of(others))
        rest = known[0] if known else without(model, own)
        found.append((_share(model, rest), rest))
    if not found:
        return None
    share, less = min(found, key=lambda pair: pair[0])
    return less if share <= max(RHO) else None


def _share(model: Hypothesis, less: Hypothesis) -> float:
    """What a model changes beside one with a law less, over what that one changes beside none: rms of what is measured,
    each at its own fit."""
    here, there = model.fit.linear.residual, less.fit.linear.residual
    moved, others = float(np.linalg.norm(here - there)), float(np.linalg.norm(there - model.bare))
    return moved / others if others > 0 else np.inf

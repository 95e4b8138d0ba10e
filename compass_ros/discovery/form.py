"""Which laws of a model are physics of their own, and which stand for what the form of the others lacks.

A law is a formula, and nature's is another one: a discrepancy in proportion to it, up to `RHO`, is expected of every
law and is no physics of its own. Where laws leave no more than such a share of what they change, a further one that
pushes only where they push is that discrepancy, written by other means: unless it takes all that they leave above the
noise, for the rest of a form is seldom a formula of the library itself. It stays in the simulator, where it is worth
its evidence, and is not named.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.special import chdtri

from compass_ros.discovery.evidence import log_sum
from compass_ros.discovery.hypothesis import Hypothesis
from compass_ros.discovery.odds import Known, Weighed
from compass_ros.discovery.settings import RHO, SLIGHT
from compass_ros.simulation.effects import Attached


def told_apart(known: Known, least: float) -> list[Weighed]:
    """Models, those that name the same laws as one: its most probable member, with the odds of all.

    Models below `least` log odds keep all their laws.
    """
    groups: dict[frozenset[tuple[str, tuple[str, ...]]], list[Weighed]] = {}
    for model, odds in known.ordered:
        said = replace(model, corrections=_corrections(known, model)) if odds >= least else model
        key = frozenset((a.effect.name, a.objects) for a in said.physics)
        groups.setdefault(key, []).append((said, odds))
    merged = [(group[0][0], log_sum(np.array([odds for _, odds in group]))) for group in groups.values()]
    return sorted(merged, key=lambda weighed: -weighed[1])


def _corrections(known: Known, model: Hypothesis) -> tuple[Attached, ...]:
    """Laws of a model that correct the form of its others, the least of them first as long as there are any."""
    kept = model
    while less := _less(known, kept):
        kept = less
    return tuple(a for a in model.laws if a not in kept.laws)


def _less(known: Known, model: Hypothesis) -> Hypothesis | None:
    """The model without one of its laws that corrects the others, those that leave least; None: without any."""
    names = dict.fromkeys(a.effect.name for a in model.laws)
    found: list[tuple[float, Hypothesis]] = []
    for name in names if len(names) > 1 else ():
        own = [a for a in model.laws if a.effect.name == name]
        others = [a for a in model.laws if a.effect.name != name]
        pushed = model.sizes_of(own) > 0
        if not np.any(pushed) or np.any(model.sizes_of(others)[pushed] == 0):
            continue  # a scatter has no form, and what acts elsewhere corrects nothing
        rest = known.without(model, own)
        if rest and (at_noise(rest[0]) or not at_noise(model)):
            found.append((left_over(rest[0]), rest[0]))
    if not found:
        return None
    left, less = min(found, key=lambda pair: pair[0])
    return less if left <= max(RHO) else None


def at_noise(model: Hypothesis) -> bool:
    """Whether the mean square of what a fit leaves is one that the noise itself exceeds with probability SLIGHT."""
    independent = model.likelihood.measurements / model.likelihood.correlation_time
    return bool(model.chi_square * independent <= chdtri(independent, SLIGHT))


def left_over(model: Hypothesis) -> float:
    """What the laws of a model leave above the noise, as a share of what they change: rms of all that is measured."""
    changed = float(np.linalg.norm(model.bare - model.fit.linear.residual))
    return float(np.sqrt(model.above_noise)) / changed if changed > 0 else np.inf

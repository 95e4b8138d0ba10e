"""Which laws of a model are physics of their own, and which stand for what the form of the others lacks.

A law is a formula, and nature's is another one: a discrepancy in proportion to it, up to `RHO`, is expected of every
law and is no physics of its own. A further law that changes no more than such a share of what all of them change, in
every signal, is that discrepancy, written by other means: unless it takes all that they leave above the noise, for the
rest of a form is seldom a formula of the library itself. It stays in the simulator, where it is worth its evidence, and
is not named.
"""

from __future__ import annotations

from dataclasses import replace
from math import log

import numpy as np

from compass_ros.calibration.cost import robust_loss
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
    """The model without one of its laws that corrects the others, the one that changes least; None: without any."""
    names = dict.fromkeys(a.effect.name for a in model.laws)
    found: list[tuple[float, Hypothesis]] = []
    for name in names if len(names) > 1 else ():
        own = [a for a in model.laws if a.effect.name == name]
        if all(a.effect.scattered for a in own):
            continue  # a scatter has no form
        rest = known.without(model, own)
        if rest and (rest[0].at_noise or not model.at_noise):
            found.append((share_of(model, rest[0]), rest[0]))
    if not found:
        return None
    share, less = min(found, key=lambda pair: pair[0])
    return less if share <= max(RHO) else None


def share_of(model: Hypothesis, rest: Hypothesis) -> float:
    """What a model predicts otherwise than the rest of it at its own fit, as a share of what all its laws change: the
    largest over signals, of those where it is worth odds of SLIGHT."""
    residual, robust, kappa = model.fit.linear.residual, model.fit.robust, model.likelihood.correlation_time
    worth = robust_loss(rest.fit.linear.residual, robust) - robust_loss(residual, robust)
    moved, changed = rest.fit.linear.residual - residual, model.bare - residual
    largest = 0.0
    for one in (list(columns) for signal in model.simulator.cell.signals for columns in signal.together):
        if 0.5 * float(worth[..., one].sum()) / kappa > -log(SLIGHT):
            change = float(np.linalg.norm(changed[..., one]))
            largest = max(largest, float(np.linalg.norm(moved[..., one])) / max(change, 1e-300))
    return largest

"""Another law of forces in the place of one of a model's, from where the model stands.

About a fit without a law first order is about a motion that is not nature's, and a fit from the cell's first guess may
end beside the right one. Where a model explains the motion, its law can be taken out of the linear model and another
one put in: only the difference of their forces along that motion has to be small for first order to hold.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from compass_ros.discovery.candidates import Candidate
from compass_ros.discovery.evidence import Tangent
from compass_ros.discovery.first_order import FirstOrder
from compass_ros.discovery.fits import in_place
from compass_ros.discovery.hypothesis import Hypothesis
from compass_ros.discovery.neighbours import RACED, promising, rank
from compass_ros.discovery.odds import Known

_UNBOUND = 1e9
"""Scale of the robust loss [sigma]: what a law that is taken out leaves are no outliers."""


def swap(known: Known, model: Hypothesis, candidates: Sequence[Candidate]) -> None:
    """Fit the laws that could stand best for each law of forces of a model, all else as it is there."""
    for name in dict.fromkeys(a.effect.name for a in model.laws):
        own = [a for a in model.laws if a.effect.name == name]
        if not all(model.response.follows(a) and not a.effect.scattered for a in own):
            continue
        others = [c for c in candidates if c.by_force and c.name != name and not c.attached.effect.scattered]
        ranked = rank(FirstOrder(model.response, taken_out(model, name)), others)
        tried = promising(ranked, model)[:RACED]
        known.take(in_place(model, own, r) for r in tried)


def taken_out(model: Hypothesis, name: str) -> Tangent:
    """A model without its laws of that name, linear about the motion that they explain."""
    response, tangent = model.response, model.response.tangent
    own = [(attached, numbers) for attached, numbers in model.own() if attached.effect.name == name]
    pushed = sum(response.accelerations(a, model.fit.point.values[n]) for a, n in own)
    flat = np.asarray(pushed).reshape(len(tangent.residual), -1)
    columns = model.fit.free[response.inside]
    of_law = np.isin(columns, np.concatenate([np.arange(n.start, n.stop) for _, n in own]))
    kept = np.concatenate([np.flatnonzero(~of_law), np.arange(len(columns), tangent.parameters.shape[2])])
    return replace(
        tangent,
        residual=tangent.residual - (tangent.pushes @ flat[:, :, None])[..., 0],
        parameters=tangent.parameters[:, :, kept],
        away=tangent.away[kept],
        robust=_UNBOUND,
    )

"""Whether two effects of one fit are two causes, or one cause in another form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from compass_ros.calibration.least_squares import cost, robust_weight
from compass_ros.discovery.joint import Joint
from compass_ros.types import Floats

ONE_CAUSE = 0.95
"""Cosine from which what two effects do is taken for one effect whose form is neither's: a lag and a latency, say."""


def likeness(pair: Joint) -> float:
    """|cosine| of what two effects change in the recordings, less what the parameters could do instead; 0 to 1."""
    likelihood, fit = pair.likelihood, pair.fit
    known = len(pair.simulator.cell.parameters)
    points = [fit.point, *(replace(fit.point, values=_without(pair, which), cost=np.inf) for which in (0, 1))]
    residual, *others = cost(likelihood, points, fit.robust)[1]
    weight = np.sqrt(robust_weight(residual, fit.robust))
    count = int(np.sum(fit.free < known))
    tangents = (fit.linear.jacobian[..., :count] * weight[..., None]).reshape(-1, count)
    design = np.vstack([tangents, np.eye(count)])
    changes = np.stack([((residual - other) * weight).ravel() for other in others], axis=1)
    changes = np.vstack([changes, np.zeros((count, 2))])
    left = changes - design @ np.linalg.lstsq(design, changes, rcond=None)[0]
    norm = np.linalg.norm(left, axis=0)
    return float(abs(left[:, 0] @ left[:, 1]) / max(norm[0] * norm[1], 1e-12))


def _without(pair: Joint, which: int) -> Floats:
    """(P + Q,) values with one effect absent: its amplitudes zero."""
    values = pair.fit.point.values.copy()
    at = len(pair.simulator.cell.parameters)
    for index, attached in enumerate(pair.added):
        for quantity in attached.effect.quantities:
            if index == which and quantity.amplitude:
                values[at] = 0.0
            at += 1
    return values

"""Other places to begin, where a fit from the defaults is lost.

Servos whose gain, damping, friction and delay are all unknown have minima beside the right one: a stiff servo at its
force limit lags behind as a soft one does. From one start a fit ends in any of them. So where the beginning of the
episodes is not explained, it is fitted from other draws of the prior as well (multi-start with a quasi-random sequence:
Boender and Rinnooy Kan 1989, Handbooks in OR 1, chapter 9). What one object needs hardly depends on what another one
is, and of five joints no start is right for all: the answers are crossed over, object by object, and each keeps the
values that lower the cost (uniform crossover: Syswerda 1989, ICGA 3).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.special import ndtri

from compass_ros.calibration.cost import ROBUST, Point, cost, start
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.residuals import typical_residual
from compass_ros.types import Floats, Ints

OTHERS = 15
"""Other starts: a budget. The loss of the beginnings of SO-101's windows falls from 1897 thousand nats with none or one
of them to 1751 with 2 or 4, 1683 with 7 and 1640 with 15, which take 96 s of processor time (docs/method.md)."""


def lost(likelihood: Likelihood, point: Point) -> bool:
    """Whether the beginnings of windows leave residuals for which the loss has to be widened: that is not noise.

    A shot begins simply, and its beginning has one minimum; a window begins in the middle of a motion.
    """
    return likelihood.windowed and 3.0 * typical_residual(likelihood, point) > ROBUST


def draws(likelihood: Likelihood, free: Ints, values: Floats) -> Floats:
    """(OTHERS, P) values, those that are free from the prior within its bounds: a scrambled Sobol sequence."""
    from scipy.stats import qmc  # takes a second to import, and few fits need it

    shares = qmc.Sobol(len(free), scramble=True, seed=0).random(OTHERS + 1)[1:]
    out = np.tile(values, (OTHERS, 1))
    drawn = likelihood.prior_mean[free] + likelihood.prior_std[free] * ndtri(shares)
    out[:, free] = np.clip(drawn, likelihood.low[free], likelihood.high[free])
    return out


def parts(likelihood: Likelihood) -> list[Ints]:
    """Parameters of one object each, as their names say (`object@kind@name`)."""
    owners = [p.name.partition("@")[0] for p in likelihood.parameters]
    return [np.flatnonzero([owner == one for owner in owners]) for one in dict.fromkeys(owners)]


def crossed(likelihood: Likelihood, found: Sequence[Floats], robust: float) -> Point:
    """The best of some (P,) values, each part of it as in the one of them that lowers the cost most there."""
    points = [start(likelihood, values) for values in found]
    costs, _ = cost(likelihood, points, robust)
    best = points[int(np.argmin(costs))]
    for part in parts(likelihood):
        tried = [replace(best, values=_with(best.values, part, values)) for values in found]
        costs, _ = cost(likelihood, tried, robust)
        best = replace(tried[int(np.argmin(costs))], cost=float(costs.min()))
    return best


def _with(values: Floats, part: Ints, others: Floats) -> Floats:
    out = values.copy()
    out[part] = others[part]
    return out

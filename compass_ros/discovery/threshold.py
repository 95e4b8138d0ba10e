"""How much better than the plain model another one looks where nothing is missing: a parametric bootstrap.

Recordings are simulated from the plain model, as its fit plus noise of the recordings' own correlation, and judged to
first order by the same measure as the real ones: the largest log posterior odds of any model against the plain one.
What first order does not have is added: a rough simulator's fits end in one of many valleys (`by_valley`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.stats import median_abs_deviation

from compass_ros.calibration.cost import robust_weight
from compass_ros.calibration.noise import Noise, correlated
from compass_ros.discovery.discrepancy import kinds_of
from compass_ros.discovery.evidence import log_mean
from compass_ros.discovery.first_order import Ranked
from compass_ros.discovery.response import Response
from compass_ros.discovery.settings import PRIOR_UNKNOWN
from compass_ros.discovery.sized import Reduced
from compass_ros.types import Floats

BEYOND = 2
"""Simulated recordings that lie beyond the odds that noise exceeds with probability alpha: 2 / alpha are drawn."""
AT_ONCE = 200
"""Of them, those that are in memory together."""


def largest_odds(
    response: Response,
    ranked: Sequence[Ranked],
    priors: Sequence[float],
    noise: Noise,
    alpha: float,
    seed: int,
) -> Floats:
    """(BEYOND / alpha,) largest log posterior odds against the plain model, in recordings simulated from it.

    `priors`: log prior odds of each ranked law.
    """
    rng, counts = np.random.default_rng(seed), at_once(round(BEYOND / alpha))
    return np.concatenate([_largest_odds(response, ranked, priors, noise, rng, count) for count in counts])


def by_valley(gains: Floats, count: int, seed: int) -> Floats:
    """(count,) log odds against the plain model that another one gets by the valley in which its fit ends: at least 0,
    else normal as the `gains` of the plain model's own fits from other starts are, by their median and its absolute
    deviation, for one start in another motion altogether would be all of a standard deviation."""
    drawn = np.random.default_rng(seed).standard_normal(count)
    spread = float(median_abs_deviation(gains, scale="normal"))
    return np.maximum(float(np.median(gains)) + spread * drawn, 0.0)


def at_once(count: int) -> list[int]:
    """Sizes of the parts in which so many are drawn."""
    return [min(AT_ONCE, count - begun) for begun in range(0, count, AT_ONCE)]


def _largest_odds(
    response: Response,
    ranked: Sequence[Ranked],
    priors: Sequence[float],
    noise: Noise,
    rng: np.random.Generator,
    count: int,
) -> Floats:
    """(count,) of them."""
    tangent = response.tangent
    weight, rows = robust_weight(tangent.residual, tangent.robust), tangent.residual.shape
    draws = np.stack([simulated(response, noise, rng).reshape(rows) for _ in range(count)], axis=2)
    weighted = draws * (weight / tangent.correlation_time)[:, :, None]
    squares = np.einsum("edm,edm->m", weighted, draws)

    def products(columns: Floats) -> Floats:
        return np.asarray(columns.transpose(0, 2, 1) @ weighted)

    centred = replace(tangent, away=np.zeros_like(tangent.away), own_away=np.zeros_like(tangent.own_away))
    last = np.concatenate([products(c) for c in (tangent.parameters, tangent.own, tangent.pushes)], axis=1)
    reduced = Reduced(centred, tangent.normal, last, squares)
    (plain,) = reduced.logs(reduced.axes(None), [1.0])
    kinds = [[reduced.axes(one) for part in kind.values() for one in part] for kind in kinds_of(response)]
    by_kind = [log_mean([log_mean(reduced.logs(axes, axes.shown())) for axes in kind]) for kind in kinds if kind]
    best = log_mean(by_kind) - plain + PRIOR_UNKNOWN
    p, own = tangent.parameters.shape[2], tangent.own.shape[2]
    narrow = replace(centred, pushes=centred.pushes[:, :, :0])  # a law alone has no discrepancy here
    for one, prior in zip(ranked, priors, strict=True):
        wider = narrow.more(one.columns, np.zeros(one.columns.shape[2]))
        more = np.concatenate([last[:, :p], products(one.columns), last[:, p : p + own]], axis=1)
        reduced = Reduced(wider, wider.normal, more, squares)
        (with_it,) = reduced.logs(reduced.axes(None), [1.0])
        best = np.maximum(best, with_it - plain + prior)
    return np.asarray(best)


def simulated(response: Response, noise: Noise, rng: np.random.Generator) -> Floats:
    """(E, F, C) residuals [sigma] of recordings of the plain model at its fit; 0 where nothing was measured.

    An encoder counts: its error is what the fitted motion makes of whole steps from a zero that nobody knows, and not
    white. What else there is of noise has the recordings' own correlation.
    """
    likelihood, linear = response.likelihood, response.fit.linear
    shape = likelihood.measured.shape
    seen = ~np.isnan(likelihood.measured)
    white = correlated(rng.standard_normal(shape), noise.correlation)
    if noise.step is None:
        return np.where(seen, white, 0.0)
    step = noise.step
    counts = step > 0
    fitted = np.where(seen, likelihood.measured + linear.residual * likelihood.sigma, 0.0)
    rest = np.sqrt(np.maximum(noise.sigma**2 - step**2 / 12, 0.0))
    true = fitted + rng.uniform(-0.5, 0.5, shape[2]) * step
    size = np.where(counts, step, 1.0)
    read = size * np.round((true + rest * white) / size)
    error = np.where(counts, true - read, white * likelihood.sigma)
    return np.where(seen, error / likelihood.sigma, 0.0)

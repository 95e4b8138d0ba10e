"""What is said where no effect stands out: that it is noise only if episodes that were never fitted say so too.

`none` means that what is left is noise. An error in held-out episodes of TWICE the noise floor is three quarters
something else in mean square, so it is never `none` beside it. It may be noise that neither stillness nor calm flight
show (frames that are lost, stamps that are a little off, blur); then the floor is higher than it was taken for. Or
something is missing for which no law stands. What the error bars of the parameters and the engine's approximations
leave open there is no such error: a rebound from an edge that no parameter, and no step, is exact enough for.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from compass_ros.calibration.cost import Point, cost, start
from compass_ros.calibration.least_squares import Fit
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.noise import Noise, correlation_of
from compass_ros.calibration.residuals import residual_at
from compass_ros.discovery.nuisances import nuisances
from compass_ros.discovery.threshold import at_once
from compass_ros.simulation import Simulator
from compass_ros.types import Floats, Mismatch, Where

TWICE = 2.0
"""Held-out error over noise floor from which what is left is not called noise."""
EVERYWHERE = Where("all", "all", "all")


def shown_noise(noise: Noise, likelihood: Likelihood, fit: Fit) -> Noise:
    """The noise with what the fitted episodes show of it beyond what the recordings alone did.

    What a model misses follows the motion; in second differences of neighbouring frames it is gone, and what is left of
    white noise is 6 times its variance, of noise of correlation r (AR(1)) that less a share (4 r - r^2) / 3. Outliers
    count as far away as they are.
    """
    residual = residual_at(likelihood, fit.point)
    seen = ~np.isnan(likelihood.measured)
    missed = np.where(seen, residual * likelihood.sigma, np.nan)
    change = (missed[:, :-2] - 2 * missed[:, 1:-1] + missed[:, 2:]).reshape(-1, missed.shape[2])
    count = np.maximum(np.sum(~np.isnan(change), axis=0), 1)
    r = correlation_of(likelihood.correlation_time)
    known = noise.sigma**2 * (1 - (4 * r - r**2) / 3)
    more = np.maximum(np.nansum(change**2, axis=0) / (6 * count) - known, 0.0)
    return replace(noise, with_outliers=np.maximum(noise.rms, np.sqrt(noise.sigma**2 + more)))


def left_open(simulator: Simulator, fit: Fit, among: Floats, held_out: Likelihood, alpha: float, seed: int) -> float:
    """How far [sigma, rms] predictions of held-out episodes may be off for the error bars of parameters and laws and
    for what any model may be off by (`nuisances`), alone.

    `among`: covariance of what is free in the fit, in squares of the standard deviations of the prior.

    The largest over n draws of the parameters, of the nuisances, and of what the step does in each episode where things
    touch: a posterior predictive check (Gelman, Meng and Stern 1996), which a right model fails once in n + 1 times
    where collisions amplify everything. So n + 1 is 1 / alpha: a false alarm here is one of the verdict's.
    """
    rng = np.random.default_rng(seed)
    seen = ~np.isnan(held_out.measured)
    if not len(fit.free) or not seen.any():
        return 0.0
    best = start(held_out, fit.point.values)
    residual = residual_at(held_out, best)
    engine = nuisances(simulator, held_out, replace(fit, point=best, linear=replace(fit.linear, residual=residual)))
    largest = 0.0
    for draws in at_once(round(1 / alpha) - 1):
        moves = rng.multivariate_normal(np.zeros(len(fit.free)), among, draws, check_valid="ignore")
        off = cost(held_out, [_moved(held_out, fit, move) for move in moves], fit.robust)[1] - residual
        off = off + np.einsum("efcn,dn->defc", engine, rng.standard_normal((draws, engine.shape[3])))
        if simulator.places.touching:
            off = off + rng.standard_normal((draws, len(engine), 1, 1)) * engine[..., 0]
        largest = max(largest, float(np.sqrt(np.mean(off[:, seen] ** 2, axis=1)).max()))
    return largest


def _moved(held_out: Likelihood, fit: Fit, move: Floats) -> Point:
    """(p,) standard deviations of the prior from a fit, within the bounds."""
    values = fit.point.values.copy()
    values[fit.free] += move * held_out.prior_std[fit.free]
    return start(held_out, np.clip(values, held_out.low, held_out.high))


def honest(mismatch: Mismatch, error: float, floor: float, open_sigma: float = 0.0) -> Mismatch:
    """The answer as it may be published beside these numbers: where an error of TWICE the floor is left, by the laws
    too that are named, it says so; and it is not `none` there, but for what is left open (`left_open`)."""
    if mismatch.verdict not in ("none", "named", "ambiguous") or error < TWICE * floor:
        return mismatch
    times = f"{error / floor:.1f} times the noise"
    if error < TWICE * floor * np.hypot(1.0, open_sigma):
        said = f"The held-out error is {times}, which error bars of the parameters and the numerics leave open."
        return replace(mismatch, sentence=f"{mismatch.sentence} {said}")
    if mismatch.verdict != "none":
        said = f"More is missing: the held-out error is still {times}, and no law of the library explains what is left."
        return replace(mismatch, sentence=f"{mismatch.sentence} {said}")
    sentence = f"Something differs that no known law explains: held-out error {times}."
    return replace(mismatch, verdict="unknown", where=EVERYWHERE, sentence=sentence)

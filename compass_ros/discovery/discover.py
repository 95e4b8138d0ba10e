"""From a calibrated simulator to a verdict on what it lacks."""

from __future__ import annotations

import numpy as np

from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.noise import Noise
from compass_ros.calibration.refine import Refined
from compass_ros.discovery.candidates import candidates
from compass_ros.discovery.first_order import FirstOrder, Ranked
from compass_ros.discovery.hypothesis import Hypothesis
from compass_ros.discovery.numerics import numerical_cause
from compass_ros.discovery.plan import objections
from compass_ros.discovery.search import Prior, rank, search
from compass_ros.discovery.threshold import largest_odds
from compass_ros.discovery.verdict import Discovery, Judge, data_bad, fit_failed, not_evaluated
from compass_ros.errors import DataError
from compass_ros.simulation import Simulator
from compass_ros.types import Progress, Report

MIN_EPISODES = 3


def discover(
    simulator: Simulator,
    refined: Refined,
    held_out: Likelihood,
    noise: Noise,
    seed: int,
    report: Report,
    alpha: float = 0.01,
) -> Discovery:
    """Look for what the calibrated simulator lacks, at a false-alarm rate; `held_out` is opened after the verdict."""
    likelihood = refined.likelihood
    if len(likelihood.inputs) < MIN_EPISODES:
        return not_evaluated(f"{len(likelihood.inputs)} fitted episodes are too few, {MIN_EPISODES} are the least")
    if not simulator.moving:
        return not_evaluated("nothing that is tracked in this cell moves by itself")
    try:
        rate = 1 / float(np.median(np.diff(likelihood.time_s, axis=1)))
        warnings = objections(simulator.cell, likelihood.inputs, rate)
    except DataError as error:
        return data_bad(f"These recordings cannot answer: {error}.")

    def tell(stage: str, done: float) -> bool:
        return report(Progress(stage, 0, done, float("nan"), float("nan")))

    tell("screen laws", 0.0)
    plain = Hypothesis((), simulator, likelihood, refined.fit)
    asked = candidates(simulator, plain.response.values, likelihood.inputs, likelihood.time_s)
    first = rank(FirstOrder(plain.response), asked)
    prior = Prior.of(asked)
    priors = [prior.of_laws([f.candidate.name]) for f in first]
    odds = largest_odds(plain.response, first, priors, prior.unknown, noise, seed)
    threshold = max(float(np.quantile(odds, 1 - alpha)), 0.0)
    tell("fit laws", 0.2)
    found = search(plain, first, asked, threshold, tell)
    best = max([found.unknown, *found.odds])
    if best > threshold and (cause := numerical_cause(plain, best)):
        return fit_failed(f"{cause}: that is the simulator's numerics, not physics")
    tell("judge", 0.95)
    return Judge(found, held_out, noise, alpha, threshold, odds, undetectable(first), seed, warnings).discovery()


def undetectable(first: list[Ranked]) -> tuple[str, ...]:
    """Names of laws that these recordings would show on no site."""
    seen = {r.candidate.name for r in first if r.seen}
    return tuple(dict.fromkeys(r.candidate.name for r in first if r.candidate.name not in seen))

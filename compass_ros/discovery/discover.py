"""From a calibrated simulator to a verdict: all explanations of what it lacks, weighed by one measure."""

from __future__ import annotations

from dataclasses import replace
from math import log

import numpy as np

from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.noise import Noise
from compass_ros.calibration.refine import Refined
from compass_ros.calibration.roughness import gains_by_chance
from compass_ros.discovery.candidates import candidates
from compass_ros.discovery.finding import Discovery, fit_failed, not_evaluated
from compass_ros.discovery.first_order import FirstOrder, Ranked
from compass_ros.discovery.floor import left_open
from compass_ros.discovery.hypothesis import Hypothesis
from compass_ros.discovery.neighbours import rank
from compass_ros.discovery.numerics import friction_that_holds, numerics_as_model, shorter_step
from compass_ros.discovery.objections import frame_rate, objections
from compass_ros.discovery.odds import Prior
from compass_ros.discovery.search import Tell, search
from compass_ros.discovery.threshold import by_valley, largest_odds
from compass_ros.discovery.verdict import Judge
from compass_ros.errors import DataError
from compass_ros.simulation import Simulator
from compass_ros.types import Mismatch, Progress, Report

MIN_EPISODES = 3


def discover(
    simulator: Simulator,
    refined: Refined,
    held_out: Likelihood,
    noise: Noise,
    alpha: float,
    seed: int,
    report: Report,
) -> Discovery:
    """Look for what the calibrated simulator lacks.

    `held_out`: episodes that are opened after the verdict. `alpha`: probability of a verdict other than `none` where
    nothing is missing.
    """
    likelihood = refined.likelihood
    if lacking := _lacking(simulator, len(likelihood.inputs)):
        return not_evaluated(lacking)
    try:
        rate_hz = frame_rate(likelihood.time_s)
        warnings = objections(simulator.cell, likelihood.inputs, rate_hz, simulator.places.touching)
    except DataError as error:
        return Discovery(Mismatch("data_bad", None, (), (), "", f"These recordings cannot answer: {error}."))

    def tell(stage: str, done: float) -> bool:
        return report(Progress(stage, 0, done, float("nan"), float("nan")))

    tell("screen effects", 0.0)
    return weigh(simulator, refined, held_out, noise, alpha, seed, tell, warnings)


def weigh(
    simulator: Simulator,
    refined: Refined,
    held_out: Likelihood,
    noise: Noise,
    alpha: float,
    seed: int,
    tell: Tell,
    warnings: tuple[str, ...] = (),
) -> Discovery:
    """What the recordings call for; `held_out` is opened after the verdict, to say what it is worth.

    Something is missing where the odds against the plain model exceed those that noise reaches with probability alpha,
    and those that leave the plain model a probability of alpha.
    """
    likelihood = refined.likelihood
    plain = Hypothesis((), simulator, likelihood, refined.fit)
    if other := friction_that_holds(plain, log((1 - alpha) / alpha)):
        return fit_failed("dry friction holds joints that are at rest where the scene's lets them creep", other)
    asked = candidates(simulator, plain.response.values, likelihood.inputs, likelihood.time_s)
    first = rank(FirstOrder(plain.response), asked)
    prior = Prior.of(asked)
    priors = [prior.of_laws([f.candidate.name]) for f in first]
    odds = largest_odds(plain.response, first, priors, noise, alpha, seed)
    threshold = max(float(np.quantile(odds, 1 - alpha)), log((1 - alpha) / alpha))
    tell("fit effects", 0.3)
    found = search(plain, first, asked, tell)
    best = max([found.unknown, *found.odds])
    if best > threshold and simulator.places.touching:
        gains = gains_by_chance(likelihood, plain.fit) / likelihood.correlation_time
        found = replace(found, chance=by_valley(gains, len(odds), seed))
        threshold = max(threshold, float(np.quantile(odds + found.chance, 1 - alpha)))
    if best > threshold:
        if cause := numerics_as_model(plain, best):
            return fit_failed(f"{cause}, which is the simulator's numerics and not physics")
        if simulator.cell.time_step is None and (finer := shorter_step(plain, best, threshold)):
            return fit_failed("what is left goes away with a shorter time step", finer)
    tell("weigh effects", 0.95)
    said = Judge(found, held_out, noise, alpha, threshold, odds, undetectable(first), warnings).discovery()
    if said.mismatch.verdict == "none":
        return replace(said, open_sigma=left_open(simulator, refined.fit, refined.among, held_out, alpha, seed))
    if said.simulator is None:
        return said
    model = next(m for m in found.models if m.simulator is said.simulator)
    unseen = model.likelihood.on(held_out)
    return replace(said, open_sigma=left_open(model.simulator, model.fit, model.among, unseen, alpha, seed))


def undetectable(first: list[Ranked]) -> tuple[str, ...]:
    """Names of laws that these recordings would show on no site."""
    seen = {r.candidate.name for r in first if r.seen}
    return tuple(dict.fromkeys(r.candidate.name for r in first if r.candidate.name not in seen))


def _lacking(simulator: Simulator, episodes: int) -> str:
    """Why nothing can be looked for; empty where it can."""
    if episodes < MIN_EPISODES:
        return f"{episodes} fitted episodes are too few, {MIN_EPISODES} are the least"
    if not (simulator.moving or simulator.in_space):
        return "laws act on joints and on bodies that move; none is tracked in this cell"
    return ""

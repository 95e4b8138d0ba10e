"""From a calibrated simulator to a verdict: screen, fit, choose, judge on episodes that were never fitted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from compass_ros.calibration.least_squares import Fit, Point, minimise
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.noise import Noise
from compass_ros.calibration.refine import Refined, polish
from compass_ros.discovery.beginning import from_the_beginning
from compass_ros.discovery.candidates import candidates
from compass_ros.discovery.choice import Choice
from compass_ros.discovery.choose import choose
from compass_ros.discovery.finding import Discovery, Finding, not_evaluated
from compass_ros.discovery.followed import followed
from compass_ros.discovery.information import information
from compass_ros.discovery.maps import residual_map
from compass_ros.discovery.noticed import noticed
from compass_ros.discovery.null import simulate_null
from compass_ros.discovery.numerics import numerical_cause
from compass_ros.discovery.plan import knowing_twins, objections, plan_of
from compass_ros.discovery.remainder import smooth_excess
from compass_ros.discovery.search import Tell
from compass_ros.discovery.tangents import screen
from compass_ros.discovery.unseen import held_out
from compass_ros.discovery.weigh import weigh
from compass_ros.errors import DataError
from compass_ros.simulation import Simulator
from compass_ros.simulation.sites import JOINTS
from compass_ros.types import Mismatch, Progress, Report

RESTARTED = 0.15
"""Share of the excess by which a plain fit from elsewhere must be better to be the new beginning."""
POOR = 4.0
"""Mean squared residual of a plain fit from which nothing near it is of use."""
MIN_EPISODES = 3


def discover(
    simulator: Simulator, refined: Refined, judge: Likelihood, noise: Noise, seed: int, report: Report
) -> Discovery:
    """Look for what the calibrated simulator lacks. `judge`: held-out episodes, same prior and noise."""
    likelihood = refined.likelihood
    if lacking := _lacking(simulator, len(likelihood.inputs)):
        return not_evaluated(lacking)
    try:
        warnings = objections(
            simulator.cell, likelihood.inputs, 1 / float(np.median(np.diff(likelihood.time_s, axis=1)))
        )
    except DataError as error:
        return Discovery(Mismatch("data_bad", None, (), (), "", f"These recordings cannot answer: {error}."))

    def tell(stage: str, done: float) -> bool:
        return report(Progress(stage, 0, done, float("nan"), float("nan")))

    tell("screen effects", 0.0)
    if of_joints(simulator):
        return weigh(simulator, refined, judge, noise, seed, tell, warnings)
    return _by_trials(simulator, refined, judge, noise, seed, tell, warnings)


def _by_trials(
    simulator: Simulator,
    refined: Refined,
    judge: Likelihood,
    noise: Noise,
    seed: int,
    tell: Tell,
    warnings: tuple[str, ...],
) -> Discovery:
    """Of bodies on a table: through collisions a fit has many minima, and models are tried from several starts."""
    likelihood = refined.likelihood
    plain = followed(refined.likelihood, refined.fit)
    asked = candidates(simulator, refined.fit.point.values, likelihood.inputs, likelihood.time_s)
    space, scores = screen(simulator, *plain, asked)
    null = simulate_null(space, scores, noise, seed)
    plan = plan_of(information(space, asked))
    asked = knowing_twins(asked, plan)
    before = residual_map(space)
    tell("screen effects", 0.3)
    found = Finding(simulator, space, refined, judge, noise, null, plan.undetectable, before, seed, warnings)
    unseen = held_out(judge, space.likelihood, space.fit)
    if not noticed(space, scores, null, noise, unseen):
        return found.none(scores, unseen)
    excess = 0.5 * smooth_excess(space.likelihood, space.fit.point, space.fit.robust) * space.likelihood.measurements
    cause = numerical_cause(space, max(excess, scores[0].gain if scores else 0.0))
    if cause:
        return found.failed(f"No verdict: {cause}. That is the simulator's numerics, not physics.")
    tell("fit effects", 0.4)
    choice = choose(space, scores, asked, unseen, from_the_beginning(simulator, *plain, asked), poor(refined))
    again = _restarted(*plain, choice, simulator)
    if again is not None:  # the plain simulator does better than it was thought to: begin again from there
        space, scores = screen(simulator, again.likelihood, again.fit, asked)
        found = replace(found, space=space, refined=again, null=simulate_null(space, scores, noise, seed))
        unseen = held_out(judge, space.likelihood, space.fit)
        if not noticed(space, scores, found.null, noise, unseen):
            return found.none(scores, unseen)
        choice = choose(space, scores, asked, unseen)
    tell("weigh effects", 0.9)
    return found.judged(choice, unseen)


def of_joints(simulator: Simulator) -> bool:
    """Whether all that is tracked is joints: their explanations are weighed by one measure (`weigh`)."""
    return all(site.kind in JOINTS for site in simulator.moving.values())


def poor(refined: Refined) -> bool:
    """Whether effects are better tried on the beginning of the episodes: frames that are lost count in full."""
    return 2 * refined.fit.point.cost > POOR * refined.likelihood.measurements


def _lacking(simulator: Simulator, episodes: int) -> str:
    """Why nothing can be looked for; empty where it can."""
    if episodes < MIN_EPISODES:
        return f"{episodes} fitted episodes are too few, {MIN_EPISODES} are the least"
    if not simulator.movers():
        return "effects act on bodies that slide in the plane and on joints; none is tracked in this cell"
    return ""


def _restarted(likelihood: Likelihood, fit: Fit, choice: Choice, simulator: Simulator) -> Refined | None:
    """The plain simulator fitted again from the best model's parameters, if that is a much better fit."""
    if not choice.singles:
        return None
    best = choice.pair or choice.singles[0]
    values = best.fit.point.values[: len(simulator.cell.parameters)]
    start = Point(values, best.fit.point.launch[:, : likelihood.inputs.shape[1]], np.inf)
    clearly = max(RESTARTED * choice.excess, 5.0)
    tolerance = 0.2 * clearly
    other = minimise(likelihood, start, fit.free, 8, fit.robust, tolerance, fresh=False)
    if fit.point.cost - other.point.cost < clearly:
        return None
    return polish(likelihood, other.point)

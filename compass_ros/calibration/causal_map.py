"""The default method, `causal-map`: which parameters matter is asked of the simulator, then their values are refined.

The graph is the paper's, parameters to factors, but found by intervention: in a simulator every parameter can be moved
alone. With e the change of a factor's trajectory per prior width and v the parameter's share of the sum of e^2 in a
shot, averaged over shots (each has one vote, so that one whose collisions amplify everything does not decide for all),
psi is v / (v + 0.003) times e^2 / (e^2 + sigma^2): an edge carries more than the share at which the paper's sparsity
weight drops one, and more than noise. The values are the maximum a posteriori of refine.py, with standard errors.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from compass_ros.calibration.cost import Point, start
from compass_ros.calibration.identifiability import IDENTIFIED, together
from compass_ros.calibration.problem import Allowance, Problem
from compass_ros.calibration.refine import COARSE, Refined, refine, standard_errors
from compass_ros.calibration.residuals import FLOOR
from compass_ros.calibration.safeguard import farther, no_farther
from compass_ros.types import Estimate, Floats, Graph, Iteration, Progress, Report

EDGE_SHARE = 0.003
"""Share of all change above which a parameter is a cause: the paper's sparsity weight, for standardised differences."""


def causal_map(problem: Problem, allowance: Allowance, seed: int, report: Report) -> Estimate:
    """Estimate all parameters that the recordings feel; the others keep their start values."""
    del allowance, seed  # deterministic, and stops by itself
    return causal_map_refined(problem, report)[0]


def causal_map_refined(problem: Problem, report: Report) -> tuple[Estimate, Refined]:
    """The estimate together with the fit that it comes from, for the search for missing physics."""
    trace: list[Iteration] = []
    spent = 0

    def counted(play: Callable[..., Any]) -> Callable[..., Any]:
        def played(values: Floats, *rest: object) -> Any:
            nonlocal spent
            spent += len(values)
            return play(values, *rest)

        return played

    def watch(stage: str, done: float, point: Point) -> bool:
        nonlocal spent
        d = problem.mean_differences(point.values[None])[0]
        spent += len(problem.actions)
        trace.append(Iteration(point.values, d, np.empty((0, 0)), spent))
        return report(Progress(stage, len(trace), 0.95 * done, float(d.mean()), float("nan")))

    watch("screen", 0.0, start(problem.likelihood, problem.start))
    known = problem.likelihood
    alike = known.predict_alike and counted(known.predict_alike)
    likelihood = replace(known, predict=counted(known.predict), predict_alike=alike)
    refined = refine(likelihood, problem.start, watch)
    kept = no_farther(likelihood, refined, problem.start, problem.distance)
    if kept is refined:
        return to_estimate(problem, refined, tuple(trace)), refined
    watch("refine", 1.0, kept.fit.point)
    note = farther(problem.distance, refined.fit.point.values, kept.fit.point.values, problem.start)
    return replace(to_estimate(problem, kept, tuple(trace)), note=note), kept


def to_estimate(problem: Problem, refined: Refined, trace: tuple[Iteration, ...]) -> Estimate:
    """The refined point with standard errors, identifiability and graph."""
    free, errors = standard_errors(refined)
    values, parameters = refined.fit.point.values, problem.parameters
    std = problem.likelihood.prior_std.copy()
    std[free] = errors
    identifiable = np.zeros(len(std), bool)
    identifiable[free] = refined.alone < IDENTIFIED
    shared = together(refined.among, identifiable[free], values[free], [parameters[i] for i in free])
    graph = intervention_graph(problem, refined)
    floor = refined.chi_square < FLOOR
    reason = f"chi-square {refined.chi_square:.2f}: " + (
        "the noise floor is reached" if floor else "above the noise floor, something else differs"
    )
    spent = trace[-1].rollouts
    return Estimate("causal-map", values, std, identifiable, graph, trace, spent, floor, reason, shared)


def intervention_graph(problem: Problem, refined: Refined) -> Graph:
    """psi from interventions near the estimate: how far each prior width moves each factor's trajectory.

    They are those by which the refinement asked what to free. What moved nothing has no edge; of hundreds of
    parameters, neither has what another one stands for.
    """
    likelihood, influence, asked = refined.likelihood, refined.influence, refined.asked
    values = np.tile(influence.point.values, (len(problem.actions), 1))
    there = likelihood.predict(values, likelihood.inputs + influence.point.launch, likelihood.time_s)
    moves = COARSE * np.moveaxis(influence.changes[..., asked], -1, 0)
    moved = problem.apart(there + moves, there[None]) / COARSE  # (P, E, F, K)
    of_shot: Floats = np.mean(moved**2, axis=2)  # (P, E, K)
    share = np.mean(of_shot / np.maximum(np.sum(of_shot, axis=0), 1e-300), axis=1)
    effect: Floats = np.sqrt(np.mean(of_shot, axis=1))
    noise = float(np.median(likelihood.sigma))
    psi = np.zeros((len(problem.parameters), len(problem.factors)))
    psi[asked] = share / (share + EDGE_SHARE) * effect**2 / (effect**2 + noise**2)
    return Graph(tuple(p.name for p in problem.parameters), problem.factors, psi, 0.5)

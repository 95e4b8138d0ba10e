"""The default method, `causal-map`: which parameters matter is asked of the simulator, then their values are refined.

The graph is the paper's, parameters to factors, but found by intervention: in a simulator every parameter can be moved
alone. psi is the share of the difference that is more than noise, e^2 / (e^2 + noise^2), with e the change of the
factor's trajectory per prior width. The values are the maximum a posteriori of refine.py, with standard errors.
"""

from __future__ import annotations

import numpy as np

from compass_ros.calibration.least_squares import Point, linearise, start
from compass_ros.calibration.problem import Allowance, Problem
from compass_ros.calibration.refine import Refined, refine, standard_errors
from compass_ros.types import Estimate, Floats, Graph, Iteration, Progress, Report

EDGE_SIGMA = 3.0
"""An edge needs a change of the factor's trajectory, rms over frames, of this many sigma per prior width."""
IDENTIFIED = 0.5
"""A parameter is identified where the recordings shrink its prior width at least to this share."""


def causal_map(problem: Problem, allowance: Allowance, seed: int, report: Report) -> Estimate:
    """Estimate all parameters that the recordings feel; the others keep their start values."""
    del allowance, seed  # deterministic, and stops by itself
    return causal_map_refined(problem, report)[0]


def causal_map_refined(problem: Problem, report: Report) -> tuple[Estimate, Refined]:
    """The estimate together with the fit that it comes from, for the search for missing physics."""
    trace: list[Iteration] = []
    spent = 0

    def watch(stage: str, done: float, point: Point) -> bool:
        nonlocal spent
        d = problem.mean_differences(point.values[None])[0]
        spent += len(problem.actions)
        trace.append(Iteration(point.values, d, np.empty((0, 0)), spent))
        return report(Progress(stage, len(trace), 0.95 * done, float(d.mean()), float("nan")))

    watch("screen", 0.0, start(problem.likelihood, problem.start))
    refined = refine(problem.likelihood, problem.start, watch)
    return to_estimate(problem, refined, tuple(trace)), refined


def to_estimate(problem: Problem, refined: Refined, trace: tuple[Iteration, ...]) -> Estimate:
    """The refined point with standard errors, identifiability and graph."""
    free, errors = standard_errors(refined)
    std = problem.likelihood.prior_std.copy()
    std[free] = errors
    identifiable = std < IDENTIFIED * problem.likelihood.prior_std
    graph = intervention_graph(problem, refined)
    floor = refined.chi_square < 1.2
    reason = f"chi-square {refined.chi_square:.2f}: " + (
        "the noise floor is reached" if floor else "above the noise floor, something else differs"
    )
    values = refined.fit.point.values
    return Estimate("causal-map", values, std, identifiable, graph, trace, trace[-1].rollouts, floor, reason)


def intervention_graph(problem: Problem, refined: Refined) -> Graph:
    """psi from interventions at the estimate: how far each prior width moves each factor's trajectory."""
    likelihood = refined.likelihood
    everything = np.arange(len(problem.parameters))
    linear = linearise(likelihood, refined.fit.point, everything, np.full(len(everything), 0.3))
    effect = np.sqrt(np.mean(np.square(np.clip(linear.jacobian, -1e4, 1e4)), axis=(0, 1)))  # (C, P)
    factors = len(problem.factors)
    per_factor = np.array_split(effect, factors, axis=0)
    e: Floats = np.stack([np.sqrt(np.sum(part**2, axis=0)) for part in per_factor], axis=1)
    psi = e**2 / (e**2 + EDGE_SIGMA**2)
    return Graph(tuple(p.name for p in problem.parameters), problem.factors, psi, 0.5)

"""The configured method, asked for the parameters."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from compass_ros.calibration.causal_map import causal_map_refined
from compass_ros.calibration.methods import compass_config, method
from compass_ros.calibration.problem import Allowance, Problem
from compass_ros.calibration.refine import Refined
from compass_ros.calibration.safeguard import farther
from compass_ros.config import CalibrationConfig
from compass_ros.types import Estimate, Report


def estimate_parameters(problem: Problem, config: CalibrationConfig, report: Report) -> tuple[Estimate, Refined | None]:
    """Run the configured method; ours hands on the fit that it ends with. No answer is farther than the start."""
    estimate, refined = _estimate(problem, config, report)
    distance, found, begun = problem.distance, estimate.values, problem.start
    if distance(found) > distance(begun):
        note = farther(distance, found, begun, begun)
        return replace(estimate, values=begun, std=np.full(len(begun), np.nan), note=note), None
    return estimate, refined


def _estimate(problem: Problem, config: CalibrationConfig, report: Report) -> tuple[Estimate, Refined | None]:
    if config.method in ("default", "causal-map"):
        return causal_map_refined(problem, report)
    compass = config.compass
    real = min(compass.n_cmd_action, len(problem.actions))
    allowance = Allowance(compass.n_round, real, compass.n_sim)
    if config.rollouts:
        iterations = max(config.rollouts // allowance.per_iteration, 1)
        allowance = Allowance(iterations, real, max(min(compass.n_sim, config.rollouts // (iterations * real)), 2))
    if config.method == "compass":
        from compass_ros.calibration.compass import compass as run  # torch takes seconds to import

        settings = compass_config(allowance, compass)
        p = problem
        return run(p.differences, p.actions, p.parameters, p.factors, p.start, settings, config.seed, report), None
    return method(config.method).run(problem, allowance, config.seed, report), None

"""All calibration methods behind one interface. Each is imported when it is called: sbi alone takes seconds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from compass_ros.calibration.problem import Allowance, Problem
from compass_ros.config import CompassConfig
from compass_ros.errors import ConfigError, nearest
from compass_ros.types import Estimate, Report

Run = Callable[[Problem, Allowance, int, Report], Estimate]
"""(problem, allowance, seed, report) -> estimate with a trace."""


@dataclass(frozen=True)
class Method:
    name: str
    sentence: str
    """What it is, for tables and `--help`."""
    run: Run


def compass_config(allowance: Allowance, base: CompassConfig | None = None) -> CompassConfig:
    """The paper's hyperparameters with the iterations, real and simulated rollouts of an allowance."""
    return replace(
        base or CompassConfig(), n_round=allowance.iterations, n_cmd_action=allowance.real, n_sim=allowance.sim
    )


def run_compass(problem: Problem, allowance: Allowance, seed: int, report: Report) -> Estimate:
    from compass_ros.calibration.compass import compass

    config = compass_config(allowance)
    p = problem
    return compass(p.differences, p.actions, p.parameters, p.factors, p.start, config, seed, report)


def _causal_map(problem: Problem, allowance: Allowance, seed: int, report: Report) -> Estimate:
    from compass_ros.calibration.causal_map import causal_map

    return causal_map(problem, allowance, seed, report)


def _npdr(problem: Problem, allowance: Allowance, seed: int, report: Report) -> Estimate:
    from compass_ros.calibration.rivals.npdr import npdr

    return npdr(problem, allowance, seed, report)


def _exi_net(problem: Problem, allowance: Allowance, seed: int, report: Report) -> Estimate:
    from compass_ros.calibration.rivals.exi_net import exi_net

    return exi_net(problem, allowance, seed, report)


def _tune_net(problem: Problem, allowance: Allowance, seed: int, report: Report) -> Estimate:
    from compass_ros.calibration.rivals.tune_net import tune_net

    return tune_net(problem, allowance, seed, report)


def _mujoco_sysid(problem: Problem, allowance: Allowance, seed: int, report: Report) -> Estimate:
    from compass_ros.calibration.rivals.mujoco_sysid import mujoco_sysid

    return mujoco_sysid(problem, allowance, seed, report)


def _cma_es(problem: Problem, allowance: Allowance, seed: int, report: Report) -> Estimate:
    from compass_ros.calibration.rivals.cma_es import cma_es

    return cma_es(problem, allowance, seed, report)


def _random_search(problem: Problem, allowance: Allowance, seed: int, report: Report) -> Estimate:
    from compass_ros.calibration.rivals.random_search import random_search

    return random_search(problem, allowance, seed, report)


DEFAULT = "causal-map"
METHODS: dict[str, Method] = {
    method.name: method
    for method in (
        Method(
            "causal-map", "Ours: causes by intervention, then maximum a posteriori on a growing horizon", _causal_map
        ),
        Method(
            "compass", "COMPASS as in the paper: causal graph, then gradient through the learned model", run_compass
        ),
        Method("npdr", "Neural posterior domain randomisation: sequential neural posterior on sbi", _npdr),
        Method("exi-net", "EXI-Net: learned forward model, parameters by back-propagation", _exi_net),
        Method("tune-net", "Tune-Net: regression of the parameter step from pairs of trajectories", _tune_net),
        Method("mujoco-sysid", "Least squares of mujoco.sysid on whole trajectories", _mujoco_sysid),
        Method("cma-es", "CMA-ES on the mean trajectory difference", _cma_es),
        Method("random", "Random search within the bounds", _random_search),
    )
}


def method(name: str) -> Method:
    """The method of that name; `default` is causal-map. Raises ConfigError naming the nearest one."""
    name = DEFAULT if name == "default" else name
    if name not in METHODS:
        raise ConfigError(f"unknown method '{name}'; available: {', '.join(METHODS)}{nearest(name, METHODS)}")
    return METHODS[name]

"""The rivals by name: what each says about the same recordings, in one form."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

from compass_ros.cells import Cell
from compass_ros.config import CalibrationConfig
from compass_ros.estimation import estimate_parameters
from compass_ros.rivals.calibrated import Calibrated, calibrate_plain, problems, rms
from compass_ros.types import Episode

ALARM = 0.05
"""p-value under which the misspecification check says that something is missing."""
ROLLOUTS = {"compass": 1920, "mujoco-sysid": 6400}
"""What they may spend by default: the paper's budget, and three of its ten iterations where a network is trained."""


@dataclass(frozen=True)
class Opinion:
    """What one rival says. None: it is not a question that this rival answers."""

    names: tuple[str, ...] | None = None
    """Effects that it says are missing."""
    alarm: bool | None = None
    """Whether it says that something is missing."""
    p_value: float | None = None
    held_out_m: float | None = None
    """rms distance of its predictions on the held-out episodes [m]."""
    note: str = ""


class Recorded:
    """Recordings posed once for all rivals; our calibration of the parameters runs when the first of them needs it."""

    def __init__(self, episodes: Sequence[Episode], cell: Cell, config: CalibrationConfig) -> None:
        self.config = config
        self.simulator, self.problem, self.data, self.judge, self.noise = problems(episodes, cell, config)

    @cached_property
    def calibrated(self) -> Calibrated:
        return calibrate_plain(self.simulator, self.problem, self.data, self.judge, self.noise)


def calibrated_alone(given: Recorded) -> Opinion:
    """What the other rivals begin with: our parameters, and no search for missing physics."""
    shots = given.calibrated.held_out
    return Opinion(held_out_m=rms(shots.predicted, shots.data.measured))


def _parameters(method: str) -> Callable[[Recorded], Opinion]:
    def run(given: Recorded) -> Opinion:
        config = replace(given.config, method=method, rollouts=given.config.rollouts or ROLLOUTS[method])
        estimate, _ = estimate_parameters(given.problem, config, lambda _: True)
        predicted = given.simulator.observe(
            estimate.values[None].repeat(len(given.judge.inputs), axis=0), given.judge.inputs, given.judge.time_s
        )
        return Opinion(held_out_m=rms(predicted, given.judge.measured), note=estimate.stop_reason)

    return run


def _sparse_regression(given: Recorded) -> Opinion:
    from compass_ros.rivals.sparse_regression import sparse_regression

    model = sparse_regression(given.calibrated)
    if model is None:
        return Opinion((), alarm=False, held_out_m=calibrated_alone(given).held_out_m, note="no model predicts better")
    note = f"window {model.window_s:g} s, {model.optimiser}"
    return Opinion(model.names, alarm=True, held_out_m=model.held_out_m, note=note)


def _misspecification(given: Recorded) -> Opinion:
    from compass_ros.calibration.rivals.misspecification import misspecification_p
    from compass_ros.rivals.well_specified import observed_and_simulated

    p = misspecification_p(*observed_and_simulated(given.calibrated, given.config.seed), given.config.seed)
    return Opinion(alarm=p < ALARM, p_value=p)


def _gaussian_process(given: Recorded) -> Opinion:
    from compass_ros.rivals.gaussian_process import gaussian_process

    return Opinion(held_out_m=rms(gaussian_process(given.calibrated), given.judge.measured))


RIVALS: Mapping[str, Callable[[Recorded], Opinion]] = {
    "calibrated": calibrated_alone,
    "compass": _parameters("compass"),
    "mujoco-sysid": _parameters("mujoco-sysid"),
    "sparse-regression": _sparse_regression,
    "sbi-misspecification": _misspecification,
    "gaussian-process": _gaussian_process,
}
"""In the order in which they are run; each is imported when it is called."""

"""The simulators that are compared, each made from the same recordings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from compass_ros.calibration.methods import method
from compass_ros.calibration.problem import Allowance
from compass_ros.config import CalibrationConfig
from compass_ros.errors import ConfigError, nearest
from compass_ros.pipeline import calibrate
from compass_ros.policy import Belief, Case, belief, one, pushing
from compass_ros.policy.augmented import augmented
from compass_ros.policy.residual import Residual
from compass_ros.posing import noise_of, pose
from compass_ros.results import write_all
from compass_ros.simulation import Simulator
from compass_ros.simulation.replay import recordings
from compass_ros.transfer.experiment import Experiment
from compass_ros.types import Episode, Floats, Report, silent

COARSER = 2.0
"""Time step in which policies are trained, over the scene's. On the table a shot then ends 3 mm elsewhere (median)."""
DRAWS = 128
NAMES: Mapping[str, str] = {
    "nominal": "as it was drawn",
    "uniform": "domain randomisation over the half-widths",
    "npdr": "NPDR, drawn from its posterior",
    "exi-net": "EXI-Net",
    "compass": "COMPASS as in the paper",
    "parameters": "ours, parameters alone",
    "laws": "ours, with the named laws",
    "posterior": "ours, drawn from its posterior",
    "residual": "ours, parameters alone, and a network on what they leave",
    "itself": "trained in the real cell: the most that can be reached",
}
SEARCHED = ("laws", "posterior")
"""Those that a search for missing physics gives."""
HELD_OUT = 0.2


@dataclass(frozen=True)
class Makers:
    """Makes simulators from the recordings of one condition, and keeps what took long in a folder."""

    experiment: Experiment
    condition: str
    episodes: tuple[Episode, ...]
    folder: Path
    seed: int = 0
    iterations: int = 3
    """Of the rivals that iterate; the paper has 10."""
    threads: int = 0
    report: Report = silent

    def make(self, name: str, fine: bool = False) -> Belief:
        """The simulator of that name, in coarser steps or, `fine`, the scene's. Raises ConfigError for others."""
        chosen([name])
        if name == "itself":
            return self.experiment.itself(self.condition)
        if name == "residual":
            return self._with_residual(self.make("parameters", fine))
        path = self.folder / f"{name}.json"
        if not path.exists():
            self.folder.mkdir(parents=True, exist_ok=True)
            if name in SEARCHED:
                self._with_laws()
            else:
                belief.save(one(self._fine, self._drawn(name)), path)
        return belief.load(path, self._fine if fine else self._coarse)

    @cached_property
    def _fine(self) -> Simulator:
        return Simulator(self.experiment.cell, threads=self.threads)

    @cached_property
    def _coarse(self) -> Simulator:
        options = {"timestep": COARSER * self._fine.time_step}
        return Simulator(self.experiment.cell, threads=self.threads, options=options)

    def _drawn(self, name: str) -> Floats:
        """(N, P)"""
        cell = self.experiment.cell
        if name == "nominal":
            return cell.defaults[None]
        if name == "uniform":
            wide = np.array([p.half_width for p in cell.parameters])
            drawn = np.random.default_rng([self.seed, 8]).uniform(-1, 1, (DRAWS, len(wide)))
            return _inside(cell.defaults + wide * drawn, self._fine)
        if name == "parameters":
            return self._alone()[None]
        data = recordings(cell, self.episodes)
        noise = noise_of(cell, data)
        allowance = Allowance(self.iterations, min(10, len(self.episodes)), 64)
        found = method(name).run(pose(self._fine, data, noise), allowance, self.seed, self.report)
        return found.values[None] if found.draws is None else found.draws

    def _alone(self) -> Floats:
        """(P,) our calibration without a search for what is missing."""
        config = CalibrationConfig(seed=self.seed, threads=self.threads, held_out_share=HELD_OUT, discover=False)
        result, _ = calibrate(self.episodes, self.experiment.cell, config, self.report)
        return np.array([row.value for row in result.parameters])

    def _with_laws(self) -> None:
        """One calibration gives two simulators, and everything that `compass calibrate` writes."""
        cell = self.experiment.cell
        config = CalibrationConfig(seed=self.seed, threads=self.threads, held_out_share=HELD_OUT)
        result, found = calibrate(self.episodes, cell, config, self.report)
        write_all(result, found, cell, self.folder / "calibration")
        values = np.array([row.value for row in result.parameters])
        simulator, numbers = found.simulator or self._fine, values if found.values is None else found.values
        belief.save(one(simulator, numbers), self.folder / "laws.json")
        rng = np.random.default_rng([self.seed, 9])
        cases = []
        for w in found.weighed:
            drawn = w.values + rng.standard_normal((DRAWS, w.root.shape[1])) @ w.root.T
            cases.append(Case(w.probability, w.simulator, _inside(drawn, w.simulator)))
        belief.save(Belief(tuple(cases)) if cases else one(self._fine, values), self.folder / "posterior.json")

    def _with_residual(self, base: Belief) -> Belief:
        data = recordings(self.experiment.cell, self.episodes)
        if self.experiment.over_time is not None:
            return augmented(base, data, pushing.CONTROL_S, self.seed)
        said = base.observe(data.inputs, data.steps_s, np.random.default_rng(0))
        return replace(base, correction=Residual(data.inputs, data.steps_s, said, data.at_steps, self.seed))


def _inside(values: Floats, simulator: Simulator) -> Floats:
    low, high = (np.array([getattr(p, end) for p in simulator.parameters]) for end in ("low", "high"))
    return np.asarray(np.clip(values, low, high))


def recorded(experiment: Experiment, condition: str, count: int, seed: int) -> tuple[Episode, ...]:
    """The fixed set of recordings: commands by chance over the whole action space, as the paper's scripted policy."""
    return experiment.play(condition, experiment.commands(count, seed), seed).episodes


def chosen(names: Sequence[str]) -> tuple[str, ...]:
    """All of these names, or all there are. Raises ConfigError for an unknown one."""
    for name in names:
        if name not in NAMES:
            raise ConfigError(f"unknown simulator '{name}'; known: {', '.join(NAMES)}{nearest(name, NAMES)}")
    return tuple(names) or tuple(NAMES)

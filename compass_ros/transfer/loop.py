"""Algorithm 1 whole: train in the simulator, play in both, calibrate, train again."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from compass_ros.episodes import write_episode
from compass_ros.errors import ConfigError
from compass_ros.policy import ROLLOUTS, Shots, train
from compass_ros.reporting.atomic import write_text
from compass_ros.results import make_writable
from compass_ros.transfer.campaign import differences, outcome
from compass_ros.transfer.experiment import Experiment
from compass_ros.transfer.simulators import NAMES, Makers, recorded
from compass_ros.types import Episode, Report, silent

Round = dict[str, object]


@dataclass(frozen=True)
class LoopConfig:
    """What the rounds do."""

    method: str = "laws"
    """What simulators are made with after round 0; one of `simulators.NAMES`."""
    rounds: int = 2
    """Calibrations at most."""
    recordings: int = 12
    """Of the fixed set, with commands by chance."""
    fresh: int = 0
    """New recordings that each round adds, with what its policy does as it explores; 0: the fixed set alone."""
    rollouts: int = ROLLOUTS
    zeta_m: float = 0.0
    """Mean trajectory difference at which the rounds end [m]."""
    judged: int = 10
    """Shots of each policy in the real cell."""
    seed: int = 0
    iterations: int = 3


def run_loop(experiment: Experiment, condition: str, config: LoopConfig, out: Path, threads: int = 0,
             report: Report = silent, say: Callable[[Round], object] = lambda row: None) -> list[Round]:  # fmt: skip
    """Rounds 0, 1, ...: each leaves `out/round_I/policy.npz` and its simulator; `out/rounds.json` has all of them.

    The rounds end at `zeta_m`, after `rounds` calibrations, or where a calibration would see nothing new.
    """
    if condition not in experiment.conditions:
        known = ", ".join(experiment.conditions)
        raise ConfigError(f"{experiment.name}: no recordings in '{condition}'; known: {known}")
    if experiment.over_time is not None:
        raise ConfigError(f"{experiment.name}: the rounds are for shots; `compass policy --campaign` trains over time")
    if config.method not in NAMES or config.method in ("nominal", "itself"):
        raise ConfigError(f"--method: expected one of the simulators that are calibrated, found '{config.method}'")
    make_writable(out)
    episodes = recorded(experiment, condition, config.recordings, config.seed)
    for episode in episodes:
        write_episode(episode, out / "bags")
    rows: list[Round] = []
    for i in range(config.rounds + 1):
        folder = out / f"round_{i}"
        make_writable(folder)
        makers = Makers(experiment, condition, episodes, folder, config.seed, config.iterations, threads, report)
        belief = makers.make("nominal" if i == 0 else config.method)
        shots = Shots(experiment.cell, belief, experiment.goal, experiment.repeats)
        agent = train(shots, config.rollouts, config.seed + i, report)
        agent.save(folder / "policy.npz")
        command = shots.command(agent.action()[None])
        judge = experiment.play(condition, np.tile(command, (config.judged, 1)), config.seed + 1000)
        explored = shots.command(agent.drawn(config.judged, config.seed + i))
        real = experiment.play(condition, explored, config.seed + 2000 + i)
        gap = float(differences(experiment, belief, explored, real, config.seed).mean())
        row: Round = {"round": i, "recordings": len(episodes), "difference_m": round(gap, 3),
                      "command": [round(float(x), 5) for x in command[0]]}  # fmt: skip
        rows.append(row | outcome(experiment, belief, command[0], judge, config.seed, config.judged))
        write_text(out / "rounds.json", json.dumps(rows, indent=1) + "\n")
        say(rows[-1])
        if gap <= config.zeta_m or (i > 0 and not config.fresh):
            break
        new = tuple(_renamed(e, f"round_{i}_{n:02d}") for n, e in enumerate(real.episodes[: config.fresh]))
        for episode in new:
            write_episode(episode, out / "bags")
        episodes += new
    return rows


def _renamed(episode: Episode, name: str) -> Episode:
    return replace(episode, name=name)

"""Soft actor-critic on shots: the settings of the paper's table, but it learns after each batch and not each eighth.

A shot costs more here than a step of learning, so that fewer shots are made to do.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from stable_baselines3 import SAC
from stable_baselines3.common.callbacks import BaseCallback

from compass_ros.policy.environment import SIDE_BY_SIDE, ShotEnv
from compass_ros.policy.shots import Shots
from compass_ros.types import Floats, Progress, Report, silent


@dataclass(frozen=True)
class Agent:
    """A trained policy."""

    model: SAC
    start: Floats
    """(S,) what it saw in training."""

    def action(self) -> Floats:
        """(A,) the best action from the start, -1 to 1."""
        chosen, _ = self.model.predict(self.start.astype(np.float32), deterministic=True)
        return np.asarray(chosen, dtype=np.float64)

    def save(self, path: Path) -> None:
        """In stable-baselines3's own format; `SAC.load` reads it."""
        self.model.save(path)


def train(shots: Shots, rollouts: int, seed: int, report: Report = silent) -> Agent:
    """Train for about `rollouts` shots. The same seed gives the same agent on the same machine."""
    model = SAC(
        "MlpPolicy",
        ShotEnv(shots),
        learning_rate=3e-4,
        buffer_size=min(max(rollouts, SIDE_BY_SIDE), 1_000_000),
        learning_starts=100,
        batch_size=32,
        tau=0.005,
        gamma=0.99,
        train_freq=1,
        gradient_steps=32,
        ent_coef=0.005,
        policy_kwargs={"net_arch": [32, 32]},
        seed=seed,
        device="cpu",
    )
    model.learn(rollouts, callback=_Watch(rollouts, report))
    return Agent(model, shots.start)


class _Watch(BaseCallback):
    """Tells how far the training is, and ends it when asked to."""

    def __init__(self, rollouts: int, report: Report) -> None:
        super().__init__()
        self._rollouts, self._report = rollouts, report

    def _on_step(self) -> bool:
        done = min(self.num_timesteps / self._rollouts, 1.0)
        return self._report(Progress("train", self.num_timesteps, done, math.nan, math.nan))

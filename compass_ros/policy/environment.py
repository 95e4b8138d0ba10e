"""Shots as an environment of stable-baselines3: an episode is one action, and its reward is known at once."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from gymnasium import spaces
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvObs, VecEnvStepReturn

from compass_ros.policy.shots import Shots
from compass_ros.types import Floats

SIDE_BY_SIDE = 64
"""Shots that are played at once (the paper's table of SAC)."""


class ShotEnv(VecEnv):
    """SIDE_BY_SIDE shots in one batch of rollouts."""

    render_mode = None

    def __init__(self, shots: Shots, count: int = SIDE_BY_SIDE) -> None:
        seen, chosen = len(shots.start), len(shots.names)
        super().__init__(
            count,
            spaces.Box(-np.inf, np.inf, (seen,), np.float32),
            spaces.Box(-1.0, 1.0, (chosen,), np.float32),
        )
        self._shots = shots
        self._actions: Floats = np.zeros((count, chosen))

    def reset(self) -> VecEnvObs:
        return np.tile(self._shots.start.astype(np.float32), (self.num_envs, 1))

    def step_async(self, actions: Floats) -> None:
        self._actions = actions.astype(np.float64)

    def step_wait(self) -> VecEnvStepReturn:
        distance, seen = self._shots.distances(self._actions), self.reset()
        rewards = self._shots.goal.reward(distance).astype(np.float32)
        infos: list[dict[str, Any]] = [
            {"terminal_observation": last, "TimeLimit.truncated": False} for last in np.asarray(seen)
        ]
        return seen, rewards, np.ones(self.num_envs, bool), infos

    def close(self) -> None:
        """Nothing is open."""

    def get_attr(self, attr_name: str, indices: int | Iterable[int] | None = None) -> list[Any]:
        return [getattr(self, attr_name)] * len(self._which(indices))

    def set_attr(self, attr_name: str, value: Any, indices: int | Iterable[int] | None = None) -> None:
        setattr(self, attr_name, value)

    def env_method(
        self, method_name: str, *method_args: Any, indices: int | Iterable[int] | None = None, **method_kwargs: Any
    ) -> list[Any]:
        return [getattr(self, method_name)(*method_args, **method_kwargs)] * len(self._which(indices))

    def env_is_wrapped(self, wrapper_class: type[Any], indices: int | Iterable[int] | None = None) -> list[bool]:
        return [False] * len(self._which(indices))

    def _which(self, indices: int | Iterable[int] | None) -> Sequence[int]:
        return list(self._get_indices(indices))

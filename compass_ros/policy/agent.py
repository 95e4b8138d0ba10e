"""An agent for shots: its episode is one action, its reward is known at once."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from compass_ros.policy.sac import Policy, learn
from compass_ros.policy.shots import Shots
from compass_ros.types import Floats, Progress, Report, silent

ROLLOUTS = 4608
"""Shots that an agent is trained with, in all beginnings."""
BEGINNINGS = 2
"""Agents that are trained from other random numbers; the one that does better in its own simulator is taken. Of five in
a simulator of the fan at high speed three scored there after 1152 shots each, four after 2304, and four after 4608."""
_JUDGED = 64
"""Shots by which they are compared."""
SIDE_BY_SIDE = 64
"""Shots that are played at once (the paper's table of SAC)."""


@dataclass(frozen=True)
class Agent:
    """A trained policy."""

    policy: Policy
    start: Floats
    """(S,) what it saw in training."""

    def action(self) -> Floats:
        """(A,) the best action from the start, -1 to 1."""
        return np.asarray(self.policy.act(self.start[None])[0])

    def drawn(self, count: int, seed: int) -> Floats:
        """(count, A) actions as it takes them while it learns."""
        return self.policy.act(np.tile(self.start, (count, 1)), np.random.default_rng([seed, 2]))

    def save(self, path: Path) -> None:
        """As NPZ; `sac.read` reads it."""
        self.policy.save(path)


class _OneShot:
    """`sac.Rollouts` of shots."""

    horizon, count = 1, SIDE_BY_SIDE

    def __init__(self, shots: Shots, seed: int) -> None:
        self.seen, self.chosen = len(shots.start), len(shots.names)
        self._shots, self._rng = shots, np.random.default_rng([seed, 7])

    def reset(self) -> Floats:
        return np.tile(self._shots.start, (self.count, 1))

    def step(self, actions: Floats) -> tuple[Floats, Floats]:
        return self.reset(), self._shots.goal.reward(self._shots.distances(actions, self._rng))


def train(shots: Shots, rollouts: int = ROLLOUTS, seed: int = 0, report: Report = silent) -> Agent:
    """Train for about `rollouts` shots. The same seed gives the same agent on the same machine."""
    goes_on = True

    def shared(progress: Progress) -> bool:
        nonlocal goes_on
        goes_on = report(replace(progress, done=(len(agents) + progress.done) / BEGINNINGS))
        return goes_on

    agents: list[Agent] = []
    while goes_on and len(agents) < BEGINNINGS:
        own = BEGINNINGS * seed + len(agents)
        agents.append(Agent(learn(_OneShot(shots, own), rollouts // BEGINNINGS, own, report=shared), shots.start))
    judged = [shots.judge(agent.action(), 0.0, seed, _JUDGED) for agent in agents]
    best = min(range(len(agents)), key=lambda k: (-judged[k].success, judged[k].distance))
    return agents[best]

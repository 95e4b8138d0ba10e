"""Shots in what is held true of a cell, and how near they bring a body to a goal."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from compass_ros.cells import Cell
from compass_ros.errors import ConfigError, nearest
from compass_ros.policy.belief import Belief
from compass_ros.simulation.replay import positions
from compass_ros.types import Floats

TERMINAL = 2.25
"""Reward for ending inside the goal (the paper's table of the training environment)."""
PER_METRE = -5.0
"""Reward for a metre between the body's last position and the goal's centre (the paper's -10, divided by 2)."""


@dataclass(frozen=True)
class Goal:
    """Where a tracked body shall be at the end of a shot, as the tracker says it."""

    object: str
    centre: tuple[float, ...]
    """x, y and, for bodies in space, z [m], frame of the cell."""
    radius: float
    """[m]"""

    def reward(self, distance: Floats) -> Floats:
        """(B,) of (B,) last distances [m]."""
        return np.asarray(PER_METRE * distance + TERMINAL * (distance <= self.radius))


@dataclass(frozen=True)
class Judged:
    """How well an action does when it is repeated as a real arm repeats it."""

    success: float
    """Share of the shots that end inside the goal."""
    distance: float
    """Mean of their last distances [m]."""


class Shots:
    """What an agent is trained in. Actions are given from -1 to 1 over the cell's action space."""

    def __init__(self, cell: Cell, belief: Belief, goal: Goal, repeats: Floats | None = None) -> None:
        """`repeats`: (A,) one standard deviation of what the arm is off in each number of a command; None: nothing.

        Raises ConfigError where the cell has no such body, or nothing that an agent could choose.
        """
        known = positions(cell)
        if goal.object not in known:
            raise ConfigError(f"{cell.name}: no object '{goal.object}'{nearest(goal.object, known)}")
        if not cell.action or len(cell.action) != len(cell.launch_std):
            raise ConfigError(f"{cell.name}: the cell has no action that an agent could choose")
        self._columns = list(known[goal.object])
        if len(goal.centre) != len(self._columns):
            raise ConfigError(f"goal: expected {len(self._columns)} numbers [m], found {len(goal.centre)}")
        self.goal, self.names = goal, tuple(a.name for a in cell.action)
        self._belief, self._end = belief, np.array([cell.duration])
        self._low, self._high = (np.array([getattr(a, side) for a in cell.action]) for side in ("low", "high"))
        self._repeats = np.zeros(len(self.names)) if repeats is None else repeats
        first = belief.observe(self.command(np.zeros((1, len(self.names)))), np.zeros(1), np.random.default_rng(0))
        self.start: Floats = first[0, 0, [column for columns in known.values() for column in columns]]
        """(S,) first positions of all objects: what the agent sees."""

    def command(self, actions: Floats) -> Floats:
        """(B, A) in the units of the cell's action."""
        return np.asarray(self._low + 0.5 * (np.clip(actions, -1, 1) + 1) * (self._high - self._low))

    def distances(self, actions: Floats, rng: Generator) -> Floats:
        """(B,) between the body's last position and the goal's centre [m]."""
        command = self.command(actions)
        command = command + self._repeats * rng.standard_normal(command.shape)
        last = self._belief.observe(command, self._end, rng)[:, 0, self._columns]
        return np.asarray(np.linalg.norm(last - np.array(self.goal.centre), axis=1))

    def judge(self, action: Floats, jitter: float, seed: int, count: int = 200) -> Judged:
        """The (A,) action `count` times, off by `jitter` (one standard deviation, share of half the action's range)."""
        rng = np.random.default_rng(seed)
        distance = self.distances(action + jitter * rng.standard_normal((count, len(action))), rng)
        return Judged(float(np.mean(distance <= self.goal.radius)), float(distance.mean()))

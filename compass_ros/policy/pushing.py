"""Push-I over time: in each of 30 steps of 50 ms a policy sees a bar and its tool and says the tool's velocity."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.random import Generator

from compass_ros.errors import ConfigError
from compass_ros.policy.augmented import POSE, Augmented, yaw
from compass_ros.policy.belief import Belief
from compass_ros.policy.sac import Policy, Settings, learn
from compass_ros.types import Bools, Floats, Report, silent

HORIZON = 30
"""The paper's T."""
CONTROL_S = 0.05
TARGET = np.array([0.16, 0.02, 0.25])
"""x, y [m] and yaw [rad] of the bar's middle at the end; ours."""
NEAR_M, NEAR_RAD = 0.02, 0.1
"""How near is near enough; ours."""
MIDDLE, HALF = np.array([0.1, 0.0]), np.array([0.2, 0.15])
"""Velocities that a policy may ask for: middle and half of the range [m/s]."""
PER_M, PER_RAD, TERMINAL = 10.0, 2.0, 2.25
SETTINGS = Settings(steps=16, batch=256)
SIDE_BY_SIDE = 64
TRANSITIONS = 60 * SIDE_BY_SIDE * HORIZON


class Bars(Protocol):
    """B bars side by side; what is seen of each: (B, 3) x, y, yaw and (B, 2) the tool."""

    count: int

    def reset(self, across: Floats) -> tuple[Floats, Floats]:
        """Put all back, with the tool at (B,) places across [m]."""
        ...

    def step(self, velocity: Floats) -> tuple[Floats, Floats]:
        """Tell the tools (B, 2) velocities for one control step."""
        ...


class Simulated:
    """Bars in what is held true; each reset draws a case for all, and parameters for each. Laws on drives or cameras
    need a history or a view that this lacks: ConfigError."""

    def __init__(self, belief: Belief, count: int, seed: int, repeats_m: float) -> None:
        self.count, self._belief, self._rng = count, belief, np.random.default_rng([seed, 6])
        self._repeats = repeats_m
        for case in belief.cases:
            for attached in case.simulator.effects:
                if attached.effect.controls is not None or attached.effect.sensing is not None:
                    raise ConfigError(f"a policy over time cannot be trained with the law '{attached.effect.name}'")
        if belief.correction is not None:
            raise ConfigError("a policy over time cannot be trained with a correction of whole trajectories")

    def reset(self, across: Floats) -> tuple[Floats, Floats]:
        case = self._belief.cases[int(self._rng.choice(len(self._belief.cases), p=self._belief.shares))]
        self._simulator, cell = case.simulator, case.simulator.cell
        self._values = case.drawn(self.count, self._rng)
        inputs = np.zeros((self.count, len(cell.input_names)))
        inputs[:, 0] = across + self._repeats * self._rng.standard_normal(self.count)
        told = self._simulator.inputs(inputs)
        self._values, self._state, *_ = self._simulator.begun(self._values, told, CONTROL_S)
        self._bias = self._values[:, [cell.index(f"env@camera@bias_{axis}") for axis in "xy"]]
        return self._seen()

    def step(self, velocity: Floats) -> tuple[Floats, Floats]:
        steps = round(CONTROL_S / self._simulator.time_step)
        told = np.repeat(velocity[:, None], steps, axis=1)
        before = self._state
        self._state = self._simulator.play(self._values, before, told, steps)[0][:, -1]
        if isinstance(self._belief, Augmented):
            self._state = self._belief.corrected(before, velocity, self._state)
        return self._seen()

    def _seen(self) -> tuple[Floats, Floats]:
        place = self._state[:, POSE][:, :2] + self._bias
        bar = np.concatenate([place, yaw(self._state)[:, None]], axis=1)
        return bar, self._state[:, 1:3] + [_TOOL_X, 0.0]


_TOOL_X = -0.036
"""Where the drawing has the tool [m]."""


@dataclass
class Pushes:
    """`sac.Rollouts` of bars."""

    bars: Bars
    seen: int = 6
    chosen: int = 2
    horizon: int = HORIZON
    across: float = 0.0
    """Where the tool begins [m]."""

    def __post_init__(self) -> None:
        self.count = self.bars.count

    def reset(self) -> Floats:
        self._now, self._tool = self.bars.reset(np.full(self.count, self.across))
        self._time = 0
        return looked(self._now, self._tool, 0)

    def step(self, actions: Floats) -> tuple[Floats, Floats]:
        before = left(self._now)
        self._now, self._tool = self.bars.step(MIDDLE + HALF * actions)
        self._time += 1
        reward = before - left(self._now)
        if self._time == HORIZON:
            reward = reward + TERMINAL * near(self._now)
        return looked(self._now, self._tool, self._time), reward


def looked(bar: Floats, tool: Floats, step: int) -> Floats:
    """(B, 6) what a policy sees: what is left to do, where the tool is in the bar's axes, the time."""
    c, s = np.cos(bar[:, 2]), np.sin(bar[:, 2])
    away = tool - bar[:, :2]
    turned = np.stack([c * away[:, 0] + s * away[:, 1], c * away[:, 1] - s * away[:, 0]], axis=1)
    time = np.full((len(bar), 1), 2 * step / HORIZON - 1)
    return np.concatenate([(TARGET - bar) * [10, 10, 2], 10 * turned, time], axis=1)


def left(bar: Floats) -> Floats:
    """(B,) cost of what is left to do."""
    away = np.linalg.norm(bar[:, :2] - TARGET[:2], axis=1)
    return np.asarray(PER_M * away + PER_RAD * np.abs(bar[:, 2] - TARGET[2]))


def near(bar: Floats) -> Bools:
    """(B,) whether place and alignment are reached."""
    away = np.linalg.norm(bar[:, :2] - TARGET[:2], axis=1)
    return np.asarray((away <= NEAR_M) & (np.abs(bar[:, 2] - TARGET[2]) <= NEAR_RAD))


def train_pushing(
    bars: Bars, seed: int, transitions: int = TRANSITIONS, report: Report = silent, across: float = 0.0
) -> Policy:
    """A policy from one simulator, whose tool begins so far across. The same seed gives the same bits on the same
    machine."""
    return learn(Pushes(bars, across=across), transitions, seed, SETTINGS, report)


def played(policy: Policy, bars: Bars, rng: Generator | None = None, across: float = 0.0) -> Floats:
    """(HORIZON + 1, B, 3) what is seen of the bars while the policy pushes them."""
    bar, tool = bars.reset(np.full(bars.count, across))
    path = [bar]
    for step in range(HORIZON):
        bar, tool = bars.step(MIDDLE + HALF * policy.act(looked(bar, tool, step), rng))
        path.append(bar)
    return np.stack(path)

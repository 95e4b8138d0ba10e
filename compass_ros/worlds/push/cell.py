"""The paper's Push-I for policies over time: bars side by side that a tool pushes, told another velocity each 50 ms.

`Pushing` steps a policy through it; `push` plays commands as in the other cells. Wrong parameters are ours, and
friction that falls with the speed of the slip is what the drawing lacks.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from compass_ros.types import Episode, Floats
from compass_ros.worlds import sensors, soft
from compass_ros.worlds.played import Played
from compass_ros.worlds.push import scene
from compass_ros.worlds.push.bar import STEP_S, TOOL_X, Feet, Physics, Rig, motion, play, tracked
from compass_ros.worlds.push.laws import Drawn
from compass_ros.worlds.world import Task

TRUE: Mapping[str, float] = {
    "feet@dyna@friction": 0.22,
    "bar@dyna@centre_x": 0.0015,
    "bar@dyna@centre_y": 0.004,
    "tool@contact@damping": -35.0,
    "tool@actuation@vel_discount": 0.95,
}
STRIBECK, AT_MS = 0.5, 0.05
"""Friction of a foot that creeps is so much larger, and falls with this speed: Armstrong-Helouvry (1991)."""
CONTROL_S = 0.05
REPEATS_M = 1e-3
"""Where the tool begins across the bar, one standard deviation; an assumption."""


def laws() -> dict[str, Drawn]:
    """What the drawing lacks."""

    def ratio(feet: Feet) -> Floats:
        slip = np.sqrt(np.sum(feet.slip**2, axis=2, keepdims=True))
        return np.asarray(1 + STRIBECK * np.exp(-slip / AT_MS))

    return {"stribeck": Drawn((), {}, "Armstrong-Helouvry (1991)", ratio=ratio)}


class Pushing:
    """Bars side by side, as the tracker sees them with its noise."""

    def __init__(self, task: Task, count: int, seed: int, physics: Physics | None = None, noisy: bool = True) -> None:
        """`physics`: None: that of this cell. `noisy`: whether tracker and arm err."""
        self._values = task.values(TRUE)
        self.count, self._rng, self._noisy = count, np.random.default_rng([seed, 4]), float(noisy)
        self._rig = Rig(self._values)
        self._physics = physics or scene.physics(self._values, laws())
        self._bias = np.array([self._values["env@camera@bias_x"], self._values["env@camera@bias_y"]])

    def reset(self, across: Floats) -> tuple[Floats, Floats]:
        """Put the tool at (B,) places across the bar [m]; what is seen: (B, 3) x, y, yaw of the bar, (B, 2) tool."""
        self.state = np.zeros((self.count, 11))
        self.state[:, :2], self.state[:, 6] = self._rig.centre, TOOL_X
        self.state[:, 7] = across + self._noisy * REPEATS_M * self._rng.standard_normal(self.count)
        return self.seen()

    def step(self, velocity: Floats) -> tuple[Floats, Floats]:
        """Tell the tool (B, 2) velocities for 50 ms."""
        told = velocity * self._values["tool@actuation@vel_discount"]
        rate = motion(self._rig, lambda time: told, self._physics)
        self.state = soft.march(rate, self.state, CONTROL_S, STEP_S)[-1]
        return self.seen()

    def seen(self, noisy: bool = True) -> tuple[Floats, Floats]:
        """The same now."""
        pose = tracked(self.state, self._rig.centre)
        where = np.concatenate([pose[:, :2] + self._bias, self.state[:, 2:3]], axis=1)
        wrong = self._rng.standard_normal(where.shape) * [scene.PLACE_M, scene.PLACE_M, scene.ANGLE_RAD]
        return where + self._noisy * noisy * wrong, self.state[:, 6:8].copy()


def push(task: Task, commands: Floats, seed: int, steps: int = 32) -> Played:
    """Play (S, 5) commands of two velocities each; the same seed gives the same bits."""
    arm, camera = (np.random.default_rng([seed, i]) for i in range(2))
    values, missing = task.values(TRUE), laws()
    done = commands.copy()
    done[:, 0] += REPEATS_M * arm.standard_normal(len(commands))
    paths = play(Rig(values), done, steps * CONTROL_S + 0.06, scene.physics(values, missing))
    time_s = CONTROL_S * np.arange(steps + 1)
    seen = np.stack(scene.seen(values, paths, missing, time_s))
    frames = np.arange(-int(scene.BEFORE_S * scene.RATE_HZ), int(steps * CONTROL_S * scene.RATE_HZ)) / scene.RATE_HZ
    episodes = []
    for n, pose in enumerate(scene.seen(values, paths, missing, frames)):
        track = scene.filmed(pose, sensors.stamps(frames), camera)
        action = {name: float(value) for name, value in zip(scene.COMMAND, commands[n], strict=True)}
        episodes.append(Episode(f"push_{n:03d}", task.name, task.hash, action, sensors.START_NS, (track,)))
    return Played(time_s, seen, tuple(episodes))

"""The paper's real cell for policies: air hockey over a fan, played by an arm, seen by a tracker.

One function: commands in, what happened and what was recorded out. The parameters are the paper's ("Sim-to-Sim Env
Parameters"), the fan is ours, and no simulator of the suite knows it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from compass_ros.types import Episode, Floats
from compass_ros.worlds import sensors
from compass_ros.worlds.played import Played
from compass_ros.worlds.table import scene
from compass_ros.worlds.table.discs import BODIES, FIXED, PUCKS, STEP_S
from compass_ros.worlds.table.fan import Fan, play
from compass_ros.worlds.world import Task

TRUE: Mapping[str, float] = {
    "pusher@actuation@vel_discount": 0.85,
    **{f"{name}@dyna@damping": -6.0 for name in (*BODIES, *FIXED)},
    "puck1@dyna@friction_sliding": 0.04,
    "puck2@dyna@friction_sliding": 0.03,
    "env@camera@bias_x": 0.03,
    "env@camera@bias_y": -0.02,
}
"""What the paper's "real" column says; all else is as in the drawing."""
FANS: Mapping[str, Fan] = {"low": Fan(edge=0.70, centre=0.88), "high": Fan(edge=0.80, centre=0.97)}
"""Two speeds, as in the paper; the drawing of the cell says 0.8 everywhere."""
REPEATS = np.array([3e-4, 3e-4, 2e-3, 0.0])
"""What the arm is off in place [m] and direction [rad], one standard deviation: what ISO 9283 calls repeatability. Our
assumption, a few times what data sheets of such arms give for a tool at rest."""
REPEATS_SPEED = 0.01
"""The same of its speed, as a share."""


@dataclass(frozen=True)
class Condition:
    """What can be changed about the cell."""

    fan: str = "low"
    mass: float = 1.0
    """Of both pucks over that of the drawing; the air lifts with the force that it lifted with."""
    rest: tuple[tuple[float, float], tuple[float, float]] = ((-0.15, 0.0), (-0.075, -0.075))
    """Where the pucks begin [m]."""


def shoot(task: Task, condition: Condition, commands: Floats, seed: int, steps: int = 50) -> Played:
    """Play (S, 4) commands; the same seed gives the same bits. `steps` of 50 ms are what `seen` shows."""
    arm, air, camera = (np.random.default_rng([seed, i]) for i in range(3))
    done = commands + REPEATS * arm.standard_normal(commands.shape)
    done[:, 3] *= 1 + REPEATS_SPEED * arm.standard_normal(len(commands))
    values = task.values(TRUE)
    for puck in PUCKS:
        values[f"{puck}@dyna@mass"] *= condition.mass
    fan = FANS[condition.fan]
    shares = {name: getattr(fan, name) / condition.mass for name in ("edge", "centre", "shot", "gust")}
    lifted = replace(fan, **shares)
    duration = steps * 0.05 + 0.02
    paths = play(values, done, duration, lifted, air, np.array(condition.rest))
    paths = paths + np.tile([values["env@camera@bias_x"], values["env@camera@bias_y"]], 2)
    time_s = 0.05 * np.arange(steps + 1)
    every = np.round(time_s / STEP_S).astype(int)
    return Played(time_s, paths[:, every], _recorded(task, commands, paths, duration, camera))


def _recorded(
    task: Task, commands: Floats, paths: Floats, duration_s: float, rng: np.random.Generator
) -> tuple[Episode, ...]:
    out = []
    count = int(scene.BEFORE_S * scene.RATE_HZ)
    time_s = np.arange(-count, int((duration_s - 0.02) * scene.RATE_HZ)) / scene.RATE_HZ
    at = np.maximum(time_s, 0.0) / STEP_S
    below = np.minimum(at.astype(int), paths.shape[1] - 2)
    share = (at - below)[:, None]
    for n, path in enumerate(paths):
        places = (1 - share) * path[below] + share * path[below + 1]
        tracks = scene.filmed(places, sensors.stamps(time_s), rng)
        action = {name: float(value) for name, value in zip(scene.COMMAND, commands[n], strict=True)}
        out.append(Episode(f"shot_{n:03d}", task.name, task.hash, action, sensors.START_NS, tracks))
    return tuple(out)

"""The paper's real cell for policies: a ball that an arm lets go above two plates, and that shall end in a basket.

Commands in, what happened and what was recorded out. Wrong parameters are the cell's targets; beyond them the plates
lose more at faster bounces, and felt drags more than the smooth sphere of the drawing.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from compass_ros.types import Floats
from compass_ros.worlds.bounce import scene
from compass_ros.worlds.bounce.ball import Push, Rig, play
from compass_ros.worlds.bounce.laws import PLATES, Drawn, lossy
from compass_ros.worlds.flight.drag import DENSITY
from compass_ros.worlds.played import Played
from compass_ros.worlds.world import Task

TRUE: Mapping[str, float] = {
    "ball@dyna@damping": -30.0,
    "ball@dyna@mass": 0.046,
    "plate1@dyna@damping": -28.0,
    "plate2@dyna@damping": -50.0,
}
LOSS_SM = 0.03
"""Of Hunt and Crossley's law on both plates: e = 1 - a v on top of the plain contact."""
FELT = 0.2
"""Drag coefficient of felt beyond a smooth sphere's."""
REPEATS_M = 1e-3
"""What the arm is off in height and place, one standard deviation; an assumption."""
STEP_S = 0.03
"""Of the cell's control."""


def laws() -> dict[str, Drawn]:
    """What the drawing lacks."""

    def felt(rig: Rig) -> Push:
        factor = 0.5 * DENSITY * np.pi * rig.radius**2 * FELT

        def push(time: float, place: Floats, velocity: Floats, spin: Floats) -> Floats:
            return np.asarray(-factor * np.linalg.norm(velocity, axis=1)[:, None] * velocity)

        return push

    loss = Drawn((), {}, "Hunt and Crossley (1975)", PLATES, extra=lambda rig: lossy(LOSS_SM))
    return {"hunt_crossley": loss, "felt_drag": Drawn((), {}, "Mehta and Pallis (2001)", push=felt)}


def drop(task: Task, commands: Floats, seed: int, steps: int = 36) -> Played:
    """Play (S, 1) heights [m]; the same seed gives the same bits."""
    arm, camera = (np.random.default_rng([seed, i]) for i in range(2))
    values = task.values(TRUE)
    heights = commands[:, 0] + REPEATS_M * arm.standard_normal(len(commands))
    rig, missing = Rig(values), laws()
    duration = steps * STEP_S + 0.06
    paths = play(rig, heights, np.zeros(len(heights)), duration, scene.physics(rig, missing))
    time_s = STEP_S * np.arange(steps + 1)
    seen = np.stack(scene.seen(values, paths, missing, time_s))
    frames = np.arange(-int(scene.BEFORE_S * scene.RATE_HZ), int(steps * STEP_S * scene.RATE_HZ)) / scene.RATE_HZ
    episodes = scene.recorded(task, values, commands[:, 0], paths, missing, frames, camera)
    return Played(time_s, seen, tuple(episodes))

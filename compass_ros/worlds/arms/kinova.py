"""Seven joints under position control (config/cells/kinova3.yaml), their torques measured in kinova3_effort.yaml.

A late command is no law here: its delay is a parameter of the cell.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.random import Generator

from compass_ros.types import Floats
from compass_ros.worlds.arms import draws
from compass_ros.worlds.arms.arm import Arm
from compass_ros.worlds.arms.motions import RATE_HZ, Range, commands, driven
from compass_ros.worlds.arms.scene import Motion, Sensors, Setup, make
from compass_ros.worlds.world import Asked, Task, World

SECONDS = 5.3
RANGES = [Range(1.5, 0.6), Range(0.7, 0.6), Range(1.5, 0.6), Range(1.2, 0.7), Range(1.5, 0.8), Range(1.0, 0.8),
          Range(1.5, 0.8)]  # fmt: skip
EFFORT = "kinova3_effort"


def _drawn(arm: Arm, rng: Generator) -> Motion:
    return _held(arm, commands(RANGES, SECONDS, rng)[1], rng)


def _drawn_as_lines(arm: Arm, rng: Generator) -> Motion:
    return _interpolated(arm, commands(RANGES, SECONDS, rng)[1], rng)


def _held(arm: Arm, targets: Floats, rng: Generator) -> Motion:
    time = np.arange(targets.shape[1]) / RATE_HZ
    return Motion(driven(time, targets, arm.delay, False, rng), time, targets)


def _interpolated(arm: Arm, targets: Floats, rng: Generator) -> Motion:
    time = np.arange(targets.shape[1]) / RATE_HZ
    return Motion(driven(time, targets, arm.delay, True, rng), time, targets)


SETUP = Setup(
    name="kinova3",
    known=({**draws.FRICTION, **draws.LOAD}, draws.FIELDS, draws.GEARS, draws.BODIES, draws.SERVOS, draws.CLOCK,
           draws.SENSING),
    outside={**draws.STRANGE, **draws.GEAR_ERROR},
    motion=_drawn,
    told=_held,
    sensors=Sensors(noise=0.0002, step=0.0003),
    tool=(0.0, 0.0, -0.12),
    load=(0.1, 1.0),
    share=2.0,
)  # fmt: skip
WITH_EFFORT = replace(
    SETUP,
    name=EFFORT,
    motion=_drawn_as_lines,
    told=_interpolated,
    sensors=Sensors(noise=0.0002, step=0.0003, effort_noise=0.3),
)


def conceal(task: Task, asked: Asked) -> World:
    """A world of kinova3, or of kinova3_effort."""
    return make(WITH_EFFORT if task.name == EFFORT else SETUP, task, asked)

"""The same two links on servos that follow commands (config/cells/two_joint_arm_driven.yaml)."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from compass_ros.types import Floats
from compass_ros.worlds.arms import draws
from compass_ros.worlds.arms.arm import Arm
from compass_ros.worlds.arms.motions import RATE_HZ, Range, commands, driven
from compass_ros.worlds.arms.scene import Motion, Sensors, Setup, make
from compass_ros.worlds.world import Asked, Task, World

SECONDS = 5.3
RANGES = [Range(0.8, 0.7), Range(0.8, 0.7)]


def _motion(arm: Arm, rng: Generator) -> Motion:
    return _told(arm, commands(RANGES, SECONDS, rng)[1], rng)


def _told(arm: Arm, targets: Floats, rng: Generator) -> Motion:
    time = np.arange(targets.shape[1]) / RATE_HZ
    return Motion(driven(time, targets, arm.delay, False, rng), time, targets)


SETUP = Setup(
    name="two_joint_arm_driven",
    known=({**draws.FRICTION, **draws.LOAD}, draws.FIELDS, draws.GEARS, draws.BODIES, draws.SERVOS,
           {**draws.LATE, **draws.CLOCK}, draws.SENSING),
    outside={**draws.STRANGE, **draws.GEAR_ERROR},
    motion=_motion,
    told=_told,
    sensors=Sensors(noise=0.0003, step=2 * np.pi / 2**12),
    tool=(0.0, 0.0, -0.3),
    load=(0.03, 0.25),
)  # fmt: skip


def conceal(task: Task, asked: Asked) -> World:
    """A world of two_joint_arm_driven."""
    return make(SETUP, task, asked)

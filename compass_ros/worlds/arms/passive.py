"""Two links that are let go and swing by themselves (config/cells/two_joint_arm.yaml)."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from compass_ros.worlds.arms import draws
from compass_ros.worlds.arms.arm import Arm
from compass_ros.worlds.arms.motions import Range, let_go
from compass_ros.worlds.arms.scene import Motion, Sensors, Setup, make
from compass_ros.worlds.world import Asked, Task, World

SECONDS = 3.2
RANGES = [Range(0.0, 1.4), Range(0.0, 1.6)]


def _motion(arm: Arm, rng: Generator) -> Motion:
    return Motion(let_go(RANGES, SECONDS, rng))


SETUP = Setup(
    name="two_joint_arm",
    known=(draws.FRICTION, draws.FIELDS, draws.GEARS, draws.BODIES, draws.SENSING),
    outside={**draws.STRANGE, **draws.BRAKE},
    motion=_motion,
    sensors=Sensors(noise=0.0002, step=2 * np.pi / 2**14),
    tool=(0.0, 0.0, -0.3),
    load=(0.004, 0.1),
    torque=(4.0, 1.0),
    share=0.3,
)


def conceal(task: Task, asked: Asked) -> World:
    """A world of two_joint_arm."""
    return make(SETUP, task, asked)

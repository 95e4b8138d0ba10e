"""The same two links on servos that follow commands (config/cells/two_joint_arm_driven.yaml)."""

from __future__ import annotations

import numpy as np

from compass_ros.worlds.arms import draws
from compass_ros.worlds.arms.commanded import Commanded
from compass_ros.worlds.arms.motions import Range
from compass_ros.worlds.arms.scene import Sensors, Setup, make
from compass_ros.worlds.world import Asked, Task, World

SERVOS = Commanded([Range(0.8, 0.7), Range(0.8, 0.7)], 5.3)

SETUP = Setup(
    name="two_joint_arm_driven",
    known=({**draws.FRICTION, **draws.LOAD}, draws.FIELDS, draws.GEARS, draws.BODIES, draws.SERVOS,
           {**draws.LATE, **draws.CLOCK}, draws.SENSING),
    outside={**draws.STRANGE, **draws.GEAR_ERROR},
    motion=SERVOS.drawn,
    told=SERVOS.told,
    sensors=Sensors(noise=0.0003, step=2 * np.pi / 2**12),
    tool=(0.0, 0.0, -0.3),
    load=(0.03, 0.25),
)  # fmt: skip


def conceal(task: Task, asked: Asked) -> World:
    """A world of two_joint_arm_driven."""
    return make(SETUP, task, asked)

"""Seven joints under position control (config/cells/kinova3.yaml), their torques measured in kinova3_effort.yaml.

A late command is no law here: its delay is a parameter of the cell.
"""

from __future__ import annotations

from dataclasses import replace

from compass_ros.worlds.arms import draws
from compass_ros.worlds.arms.commanded import Commanded
from compass_ros.worlds.arms.motions import Range
from compass_ros.worlds.arms.scene import Sensors, Setup, make
from compass_ros.worlds.world import Asked, Task, World

SERVOS = Commanded(
    [Range(1.5, 0.6), Range(0.7, 0.6), Range(1.5, 0.6), Range(1.2, 0.7), Range(1.5, 0.8), Range(1.0, 0.8),
     Range(1.5, 0.8)],
    5.3,
)  # fmt: skip
LINES = replace(SERVOS, linear=True)
EFFORT = "kinova3_effort"

SETUP = Setup(
    name="kinova3",
    known=({**draws.FRICTION, **draws.LOAD}, draws.FIELDS, draws.GEARS, draws.BODIES, draws.SERVOS, draws.CLOCK,
           draws.SENSING),
    outside={**draws.STRANGE, **draws.GEAR_ERROR},
    motion=SERVOS.drawn,
    told=SERVOS.told,
    sensors=Sensors(noise=0.0002, step=0.0003),
    tool=(0.0, 0.0, -0.12),
    load=(0.1, 1.0),
    share=2.0,
)  # fmt: skip
WITH_EFFORT = replace(
    SETUP,
    name=EFFORT,
    motion=LINES.drawn,
    told=LINES.told,
    sensors=Sensors(noise=0.0002, step=0.0003, effort_noise=0.3),
)


def conceal(task: Task, asked: Asked) -> World:
    """A world of kinova3, or of kinova3_effort."""
    return make(WITH_EFFORT if task.name == EFFORT else SETUP, task, asked)

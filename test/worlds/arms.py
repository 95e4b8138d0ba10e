"""Arms for the tests."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from compass_ros.cells import load
from compass_ros.types import Floats
from compass_ros.worlds.arms.arm import Arm
from compass_ros.worlds.arms.drawing import read
from compass_ros.worlds.arms.law import Moment
from compass_ros.worlds.world import Task

CELLS = Path(__file__).parents[2] / "config" / "cells"
ARMS = ("two_joint_arm", "two_joint_arm_driven", "kinova3", "kinova3_effort")


def task(name: str) -> Task:
    cell = load(name)
    return Task(cell.name, cell.hash, cell.model_path, cell.parameters)


def arm(name: str = "two_joint_arm") -> Arm:
    return read(CELLS / f"{name}.xml")


def frictionless(own: Arm) -> Arm:
    return replace(own, dry=np.zeros_like(own.dry), damping=np.zeros_like(own.damping))


def moment(own: Arm, q: Floats, v: Floats, time_s: float = 0.0) -> Moment:
    """Of (E, N) angles and rates; recordings begin a minute after each other."""
    q, v = np.atleast_2d(np.asarray(q, float)), np.atleast_2d(np.asarray(v, float))
    return Moment(own, time_s, 60.0 * np.arange(len(q)), q, v)

"""What a cell's scene says of the numbers that tell where something is: what they are, and how far they can go."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import mujoco
import numpy as np

from compass_ros.cells.cell import Cell


@dataclass(frozen=True)
class Limits:
    """Of one joint, or of the position of one body."""

    kind: Literal["angle", "length"]
    """A hinge's angle [rad]; a slide's or a body's position [m]."""
    low: float
    high: float
    """Range of the joint; infinite where it has none, and for bodies."""


def limits(cell: Cell, model: mujoco.MjModel) -> Mapping[str, tuple[Limits, ...]]:
    """By the name of each signal that says where something is: one for each of its joints, or one."""
    free = Limits("length", -np.inf, np.inf)
    return {
        s.name: tuple(_of_joint(model, joint) for joint in s.at) if s.jointed else (free,)
        for s in cell.signals
        if s.places
    }


def _of_joint(model: mujoco.MjModel, name: str) -> Limits:
    joint = model.joint(name)
    hinge = int(joint.type[0]) in (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_BALL)
    low, high = joint.range if model.jnt_limited[joint.id] else (-np.inf, np.inf)
    return Limits("angle" if hinge else "length", float(low), float(high))

"""First drives for a model that has none, from what the joints move and how late they follow.

A position servo on an inertia I with stiffness k and damping d has w = sqrt(k / I) and zeta = d / (2 sqrt(k I)); it
follows slow commands d / k = 2 zeta / w later (the slope of its phase at frequency 0). Drives are tuned not to
overshoot, zeta = 1, so a measured lag T says w = 2 / T, k = 4 I / T^2 and d = 4 I / T. A servo of speeds with gain d
has the time constant I / d, and lags by as much.

What turns behind a gear is part of I and in no drawing. Gears are chosen so that a rotor seems as heavy as what it
moves (inertia matching: Pasch and Seering, ASME J. Mech. Trans. 106, 1984), and the drives of one arm differ less than
what they move: the first guess is the geometric mean of what this joint and the one with most move.
"""

from __future__ import annotations

import numpy as np

from compass_ros.cells.robot import Robot, inertias
from compass_ros.cells.servo_scene import NewDrive
from compass_ros.starter.matching import Command, Found
from compass_ros.types import Floats

_POSTURES = 20
"""Recorded postures in which inertias are taken."""
_LEAST_LAG_S = 0.01
"""A lag that is measured to be less is taken for this: a servo of 30 Hz [s]."""


def moved(robot: Robot, found: Found) -> dict[str, float]:
    """Inertia that each measured joint moves, median over recorded postures [kg m^2 or kg]."""
    joints = tuple(m for one in found.measured for m in one.models)
    columns = [one.columns(m) for one in found.measured for m in one.models]
    rows: list[Floats] = []
    for recording in zip(*columns, strict=True):
        begin, end = max(c.stamp_ns[0] for c in recording), min(c.stamp_ns[-1] for c in recording)
        at = np.linspace(begin, max(end, begin), max(_POSTURES // len(columns[0]), 2)).astype(np.int64)
        rows.append(np.stack([c.at(at, False) for c in recording], axis=1))
    return dict(zip(joints, inertias(robot, joints, np.concatenate(rows)).tolist(), strict=True)) if joints else {}


def rotor(joint: str, inertia: dict[str, float], robot: Robot) -> float:
    """First guess of a drive's own inertia at its joint [kg m^2 or kg]; hinges and slides apart."""
    slide = robot.joint(joint).slide
    most = max(value for name, value in inertia.items() if robot.joint(name).slide == slide)
    return float(np.sqrt(inertia[joint] * most))


def delay_of(command: Command) -> float:
    """First guess of the delay of an input: one message, as long as a value waits on its way [s]."""
    return min(command.jointed.series.period_s, max(_typical_lag(command), 0.0) / 2)


def new_drives(robot: Robot, found: Found, inertia: dict[str, float]) -> list[NewDrive]:
    """A drive for each commanded joint that has none for commands of this kind; forces need none."""
    out: list[NewDrive] = []
    for command in found.commands:
        for name, answer in command.lags.items():
            joint = robot.joint(name)
            if command.kind in ("effort", joint.drive):
                continue
            late = answer.seconds if answer.correlation > 0 else _typical_lag(command)
            late = max(late - delay_of(command), _LEAST_LAG_S)
            own = 0.0 if joint.armature else rotor(name, inertia, robot)
            whole = inertia[name] + own
            if command.kind == "position":
                out.append(NewDrive(name, "position", 4 * whole / late**2, 4 * whole / late, own))
            else:
                out.append(NewDrive(name, "velocity", 0.0, whole / late, own))
    return [NewDrive(d.joint, d.kind, *(_round(v) for v in (d.stiffness, d.damping, d.armature))) for d in out]


def _typical_lag(command: Command) -> float:
    moving = [a.seconds for a in command.lags.values() if a.correlation > 0]
    return float(np.median(moving)) if moving else 2 * command.jointed.series.period_s


def _round(value: float) -> float:
    """Three digits: it is a guess."""
    return float(f"{value:.3g}")

"""Parameters of a first cell: what nobody can look up, with half widths that say how far off it may be."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from compass_ros.cells import made_inertias
from compass_ros.cells.robot import Joint, Link, Robot
from compass_ros.starter.drives import delay_of, rotor
from compass_ros.starter.matching import Command, Found

ZERO = {False: 0.02, True: 0.002}
"""Half width of a joint's zero, of hinges [rad] and slides [m]: set by hand and eye."""
_GAIN = 0.5
"""Half width of a gain as a share of it: a datasheet gives none, a first guess is right to a factor."""
_BEYOND = 10.0
"""Half widths from 0 to the bound of what cannot be negative; factor on a gain."""
_SHARE = 0.05
"""Friction as a share of a drive's largest force, where nothing else says it: of geared drives some per cent."""
_LATEST_S = 0.1
"""Bound of a delay, at least [s]."""


@dataclass(frozen=True)
class Guess:
    """One parameter of the YAML."""

    name: str
    field: str
    of: str
    unit: str
    default: float
    low: float
    high: float
    half_width: float
    why: str


def guesses(robot: Robot, found: Found, inertia: dict[str, float], errors: dict[str, float]) -> Iterator[Guess]:
    """All of them: the delay of each input, then joint by joint. `errors`: typical distance to the command, by joint.

    `inertia`: what each measured joint moves in the model as it was given.
    """
    for i, command in enumerate(found.commands):
        yield _delay(input_name(found, i), command)
        if pushed(command, robot):
            yield _scale(input_name(found, i))
    commands = {m: command for command in found.commands for m in command.lags}
    for one in found.measured:
        for model in one.models:
            size = rotor(model, inertia, robot)
            yield from _joint(robot.joint(model), commands.get(model), size, errors.get(model, 0.0))


def input_name(found: Found, index: int) -> str:
    return "target" if len(found.commands) == 1 else f"target_{index + 1}"


def pushed(command: Command, robot: Robot) -> bool:
    """Whether efforts act on joints as forces, since not all have a motor."""
    return command.kind == "effort" and any(robot.joint(m).drive != "effort" for m in command.lags)


def of_link(link: Link) -> Iterator[Guess]:
    """The ten numbers of a link's inertia (`cells/made_inertias.py`)."""
    size = made_inertias.size_of(link.mass, link.largest_inertia)
    for i, number in enumerate(made_inertias.NUMBERS):
        shift = number.startswith("t")
        width = made_inertias.CENTRE * size if shift else made_inertias.HALF_WIDTH
        reach = made_inertias.REACH * width
        name, unit = f"{link.name}@dyna@inertia_{number}", "m" if shift else "1"
        yield Guess(name, f"inertia_log_cholesky[{i}]", link.name, unit, 0.0, -reach, reach, width, "")


def _scale(name: str) -> Guess:
    why = "of the torques, as a motor constant"
    return Guess(f"{name}@actuation@scale", "input_scale", name, "1", 1.0, 0.2, 5.0, 0.1, why)


def _delay(name: str, command: Command) -> Guess:
    first, step = delay_of(command), command.jointed.series.period_s
    late = max([a.seconds for a in command.lags.values()], default=0.0)
    most = max(_LATEST_S, 2 * late)
    why = "from command to force; one message to begin with"
    return Guess(f"{name}@actuation@delay", "input_delay_s", name, "s", first, 0.0, most, max(step, 0.25 * late), why)


def _joint(joint: Joint, command: Command | None, size: float, error: float) -> Iterator[Guess]:
    name = joint.name
    force, length = ("N", "m") if joint.slide else ("N m", "rad")
    stiff = joint.gain if joint.drive == "position" and command is not None else 0.0
    if stiff:
        yield _gain(joint, f"{force}/{length}")
    elif command is not None and joint.drive == "effort":
        yield Guess(
            f"{name}@actuation@strength", "command_scale", joint.actuator, "1", 1.0, 0.5, 1.5, 0.1, "share that arrives"
        )
    elif command is not None and joint.drive == "velocity":
        yield _gain(joint, f"{force} s/{length}")
    critical = 2 * np.sqrt(stiff * size) if stiff else size
    rate = f"{force} s/{length}"
    if stiff and joint.servo_damping > joint.damping:
        most, width = _BEYOND * joint.servo_damping, _GAIN * joint.servo_damping
        yield Guess(f"{name}@actuation@damping", "actuator_biasprm[2]", joint.actuator, rate, -joint.servo_damping,
                    -most, 0.0, width, "the drive's, with the joint's own")  # fmt: skip
    else:
        yield _positive(
            name, "dyna@damping", "dof_damping", rate, joint.damping, max(0.5 * joint.damping, 0.1 * critical)
        )
    held = stiff * error if stiff else _SHARE * joint.most if np.isfinite(joint.most) else 0.1 * critical
    why = "dry friction" + ("; half width by how far the joint stays from its command" if stiff else "")
    yield _positive(name, "dyna@frictionloss", "dof_frictionloss", force, joint.frictionloss,
                    max(0.5 * joint.frictionloss, 0.5 * held, 1e-6), why=why)  # fmt: skip
    if command is not None:
        unit, wide = "kg" if joint.slide else "kg m^2", 0.4 * joint.armature or size
        yield _positive(name, "dyna@armature", "dof_armature", unit, joint.armature, wide, why="rotor behind the gear")
    width = ZERO[joint.slide]
    yield Guess(
        f"{name}@sensing@zero", "joint_zero", name, length, 0.0, -10 * width, 10 * width, width, "of the encoder"
    )


def _gain(joint: Joint, unit: str) -> Guess:
    """A gain of 0 is no drive."""
    return Guess(f"{joint.name}@actuation@gain", "servo_gain", joint.actuator, unit, joint.gain, joint.gain / _BEYOND,
                 _BEYOND * joint.gain, _GAIN * joint.gain, "of the servo")  # fmt: skip


def _positive(
    joint: str, what: str, field: str, unit: str, value: float, width: float, of: str = "", why: str = ""
) -> Guess:
    """Cannot be negative."""
    most = max(_BEYOND * value, _BEYOND * width)
    return Guess(f"{joint}@{what}", field, of or joint, unit, value, 0.0, most, width, why)

"""From a model and recordings to a cell that can be calibrated as it is: the YAML, a scene with drives."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from compass_ros.cells.robot import Robot, robot
from compass_ros.cells.servo_scene import write_servo_scene
from compass_ros.cells.signals import turned
from compass_ros.errors import ConfigError, nearest
from compass_ros.starter.drives import moved, new_drives
from compass_ros.starter.matching import Command, Found, Jointed, Placed, find
from compass_ros.starter.measured import Sensor, command_errors, sensor
from compass_ros.starter.names import Match, matched
from compass_ros.starter.priors import guesses, input_name, of_link, pushed
from compass_ros.starter.series import Recordings, read_all
from compass_ros.starter.text import comment, entry, listed, number, parameter, plain

DRIVEN_S, PASSIVE_S = 5.0, 2.0
"""Lengths of windows: a robot whose position is controlled forgets where it began within a second; others do not."""


@dataclass(frozen=True)
class Started:
    """What was written."""

    files: tuple[Path, ...]
    said: tuple[str, ...]
    """One sentence each."""


def start(model: Path, bags: Iterable[str | Path], out: Path, links: bool = False) -> Started:
    """Write a cell. `links`: also tune mass, centre and inertia of each link.

    Raises ConfigError or BagError: the model or a bag cannot be read, or nothing in them is the same.
    """
    given, recordings = robot(model), read_all(bags)
    found = find(recordings, given)
    if not found.measured and not found.placed:
        raise ConfigError(_nothing(given, recordings))
    inertia = moved(given, found)
    drives = new_drives(given, found, inertia)
    scene, files = model, [out]
    out.parent.mkdir(parents=True, exist_ok=True)
    if drives:
        scene = out.with_suffix(".xml") if out.with_suffix(".xml") != model else out.with_name(f"{out.stem}_driven.xml")
        write_servo_scene(model, drives, scene)
        files.append(scene)
    used = robot(scene)
    remarks = [*_about_scene(given, scene, len(drives)), *recordings.notes, *found.notes]
    lines = [*_head(out, scene, model, recordings, remarks), *_series(found, used, recordings)]
    tuned = list(guesses(used, found, inertia, command_errors(found)))
    if links:
        driven = {m for one in found.measured for m in one.models}
        tuned += [g for link in used.links if driven for g in of_link(link)]
    if tuned:
        about = "default: the scene's value or a first guess; half_width: how far off it may well be"
        lines += ["", *comment(about), "parameters:", *map(parameter, tuned)]
    else:
        lines += ["", *comment("every tunable number of the scene"), "auto: true"]
    try:
        out.write_text("\n".join(lines) + "\n", encoding="utf-8")
    except OSError as error:
        raise ConfigError(f"{out}: {error.strerror}") from error
    return Started(tuple(files), tuple(remarks))


def _about_scene(given: Robot, scene: Path, drives: int) -> Iterator[str]:
    if given.remark:
        yield given.remark
    if drives:
        yield (
            f"{given.path.name} has no drives for these commands: {scene.name} is the same with {drives} servos, their "
            "gains guessed from the inertia that each joint moves and how late it follows"
        )


def _head(out: Path, scene: Path, model: Path, recordings: Recordings, remarks: list[str]) -> list[str]:
    looked = f"{len(recordings.bags)} of {recordings.count} recordings, {min(recordings.seconds):.1f} s or longer"
    lines = comment(f"Written by `compass init` from {model.name} and {looked}.")
    for remark in remarks:
        lines += comment(f"Note: {remark}")
    relative = os.path.relpath(scene, out.parent)
    lines += [f"name: {plain(recordings.cell or out.stem)}", "dynamics: mjcf", f"model: {plain(relative)}"]
    if recordings.cell_hash:
        lines += comment("These recordings name the configuration in which they were made.")
        lines.append(f"recorded_as: {listed([recordings.cell_hash])}")
    return lines


def _series(found: Found, used: Robot, recordings: Recordings) -> Iterator[str]:
    held = any(command.kind != "effort" for command in found.commands)
    length = min(DRIVEN_S if held else PASSIVE_S, max(round(min(recordings.seconds) - 0.05, 1), 0.1))
    yield f"windows: {{length_s: {number(length)}}}"
    if found.commands:
        yield "inputs:"
        for i, command in enumerate(found.commands):
            yield from _input(command, used, input_name(found, i))
    yield "signals:"
    starts = []
    for i, one in enumerate(_alike(found, used)):
        name = "joints" if i == 0 else f"joints_{i + 1}"
        starts.append(name)
        yield from _signal(one, name)
    driving = [command.jointed.series for command in found.commands]
    for other in (one for one in found.others if one.series not in driving):
        yield from _other(other)
    for placed in found.placed:
        free = placed.at in {link.name for link in used.links if link.free}
        starts += [placed.at] if free and placed.series.held.quantity in ("pose", "position") else []
        yield from _placed(placed, free)
    if any(name in used.bodies for name in starts):
        yield "start:"
        yield from (entry([("object", plain(name))]) for name in starts)


def _alike(found: Found, used: Robot) -> Iterator[Jointed]:
    """Measured joints, hinges and slides apart, since their units differ."""
    for one in found.measured:
        for slide in (False, True):
            own = {name: match for name, match in one.joints.items() if used.joint(match.model).slide == slide}
            if own:
                yield Jointed(one.series, own)


def _input(command: Command, used: Robot, name: str) -> Iterator[str]:
    one = command.jointed
    late = [f"{m} {1e3 * a.seconds:.0f}" for m, a in command.lags.items() if a.correlation > 0]
    what = {"position": "its position", "velocity": "its speed", "effort": "its acceleration"}[command.kind]
    yield from comment(
        f"{one.series.held.topic}: a {one.series.held.type}, {1 / one.series.period_s:.0f} Hz; "
        f"of each joint {what} follows after [ms]: {', '.join(late) or 'nothing moves'}",
        2,
    )
    yield from _names_said(one.joints)
    joints = [used.joint(m) for m in one.models]
    free = pushed(command, used)
    coupled, untold = _beside(one, used, free)
    yield from _names_said(coupled)
    if untold:
        yield from comment(f"nothing of the model is called {', '.join(untold)}: not used", 2)
    given = [*_given(one), *coupled]
    pairs = [
        ("name", name),
        ("topic", plain(one.series.held.topic)),
        ("quantity", f"joint_{command.kind}"),
        ("of", listed(given)),
        ("to", "qfrc" if free else "ctrl"),
    ]
    targets = list(one.models) if free else [*(j.actuator for j in joints), *(m.model for m in coupled.values())]
    if targets != given:
        pairs.append(("at" if free else "actuators", listed(targets)))
    if command.kind == "effort" and not free and any(j.gain != 1 for j in joints):
        scales = [*(1 / j.gain for j in joints), *(1.0 for _ in coupled)]
        pairs.append(("scale", "[" + ", ".join(map(number, scales)) + "]"))
    if command.linear:
        pairs.append(("hold", "linear"))
    if one.series.held.part == "output":
        pairs.append(("part", "output"))
    yield entry(pairs)


def _beside(one: Jointed, used: Robot, free: bool) -> tuple[dict[str, Match], list[str]]:
    """What else a message tells: actuators that act on no single joint (on a tendon), and names that nothing has."""
    if not one.series.held.named:
        return {}, []
    left = [name for name in one.series.names if name not in one.joints]
    found = {} if free else matched(left, used.coupled)
    return found, [name for name in left if name not in found]


def _given(one: Jointed) -> list[str]:
    """Names in the messages; where they have none, those of the model."""
    return list(one.joints) if one.series.held.named else list(one.models)


def _names_said(joints: dict[str, Match]) -> Iterator[str]:
    """How names were matched that are not the same."""
    ways: dict[str, list[str]] = {}
    for name, match in joints.items():
        if match.how:
            ways.setdefault(match.how, []).append(f"{name} is {match.model}")
    for how, pairs in ways.items():
        yield from comment(f"matched {how}: {', '.join(pairs)}", 2)


def _sensor(one: Jointed) -> Sensor:
    return sensor([one.columns(m) for m in one.models])


def _signal(one: Jointed, name: str) -> Iterator[str]:
    found = _sensor(one)
    counts = f", counts in {found.step:.3g}" if found.step else ""
    said = f"{one.series.held.topic}: {found.rate_hz:.0f} Hz, noise {found.noise:.2g}{counts} as measured"
    yield from comment(said, 2)
    yield from _names_said(one.joints)
    pairs = [*_head_of(one, name, one.series.held.quantity), ("noise", number(found.noise))]
    yield entry(pairs + ([("step", number(found.step))] if found.step else []))


def _head_of(one: Jointed, name: str, quantity: str) -> list[tuple[str, str]]:
    pairs = [
        ("name", plain(name)),
        ("topic", plain(one.series.held.topic)),
        ("quantity", quantity),
        ("of", listed(one.joints)),
    ]
    return pairs + ([("at", listed(one.models))] if [*one.joints] != [*one.models] else [])


def _other(one: Jointed) -> Iterator[str]:
    """As a comment: estimates of the robot's own from the same encoders, or currents."""
    held, found = one.series.held, _sensor(one)
    yield from comment(f"{held.topic} also says {held.quantity}; to see it beside the simulation, take the # away:", 2)
    pairs = _head_of(one, held.quantity.removeprefix("joint_"), held.quantity)
    lines = entry([*pairs, ("noise", number(found.noise)), ("fitted", "false")]).split("\n")
    yield from (f"  #{line[2:]}" for line in lines)


def _placed(placed: Placed, free: bool) -> Iterator[str]:
    held = placed.series.held
    found = sensor([placed.series.columns(i) for i in range(min(3, placed.series.tracks[0].value.shape[1]))])
    yield from comment(f"{held.topic}: {found.rate_hz:.0f} Hz; {held.names[0]} is {placed.at} {placed.how}".rstrip(), 2)
    measured = held.quantity != "pose" or turned(placed.series.tracks)
    if not measured:
        yield from comment("its orientation is one and the same in all messages: taken as not measured", 2)
    pairs = [("name", plain(placed.at)), ("topic", plain(held.topic))]
    pairs.append(("quantity", held.quantity if measured else "position"))
    if held.named and held.names[0] != placed.at:
        pairs += [("of", listed(held.names[:1])), ("at", listed([placed.at]))]
    pairs.append(("noise", number(found.noise)))
    yield entry(pairs if free else [*pairs, ("fitted", "false")])


def _nothing(given: Robot, recordings: Recordings) -> str:
    joints, there = [j.name for j in given.joints], sorted({n for s in recordings.series for n in s.names})
    near = [f"{name}{nearest(name, joints)}" for name in there if nearest(name, joints)]
    has = f"{given.path}: nothing of it is in {recordings.bags[0].name}: its joints are {', '.join(joints) or 'none'}"
    return f"{has}; the recordings have {', '.join(there)}{' (' + near[0] + ')' if near else ''}"

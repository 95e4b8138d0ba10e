"""Twelve pushes of the cell `pushed_bar`, followed by a camera at 60 Hz: pose of the bar."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.random import Generator
from scipy.spatial.transform import Rotation

from compass_ros.types import Episode, Floats, Ints, Track
from compass_ros.worlds import draw, optics, sensors, soft
from compass_ros.worlds.push.bar import GRAVITY, STEP_S, Drive, Feet, Physics, Rig, direction, play, tracked
from compass_ros.worlds.push.laws import DRAW, KNOWN, OUTSIDE, Drawn
from compass_ros.worlds.world import Asked, Missing, Task, World, answer

PUSHES = 12
RATE_HZ = 60.0
DURATION_S = 1.6
BEFORE_S = 0.2
PLACE_M, ANGLE_RAD = 1e-3, 0.01
LOST = 0.02
LOW = np.array([-0.03, 0.15, -0.06, 0.15, -0.06])
HIGH = np.array([0.03, 0.3, 0.06, 0.4, 0.06])
"""Of a command: where across [m], two velocities [m/s]."""
COMMAND = ("y", "vx1", "vy1", "vx2", "vy2")
_SPARE_S = 0.06
_STREAMS = ("kind", "values", "laws", "pushes", "noise")


def conceal(task: Task, asked: Asked) -> World:
    """Draw and play a world of the pushed bar."""
    rng = draw.streams(asked.seed, task.name, _STREAMS)
    kind, names = draw.laws(asked, KNOWN, OUTSIDE, rng["kind"])
    values = draw.true_values(task.parameters, rng["values"])
    found = {name: DRAW[name](rng["laws"]) for name in names}
    commands = rng["pushes"].uniform(LOW, HIGH, (PUSHES, 5))
    time_s = np.arange(-int(BEFORE_S * RATE_HZ), int(DURATION_S * RATE_HZ)) / RATE_HZ
    paths: dict[tuple[str, ...], Floats] = {}

    def played(laws: Mapping[str, Drawn]) -> Floats:
        moving = tuple(name for name, law in laws.items() if law.optics is None)
        if moving not in paths:
            paths[moving] = play(Rig(values), commands, DURATION_S + _SPARE_S, physics(values, laws))
        return paths[moving]

    def see(laws: Mapping[str, Drawn]) -> Floats:
        when = optics.taken(faults(laws), time_s)
        poses = np.concatenate(seen(values, played(laws), laws, when))
        return np.concatenate([poses[:, :2] / PLACE_M, 2 * poses[:, 6:] / ANGLE_RAD], axis=1)

    alone, total = sensors.strengths(found, see, 1.0)
    laws = [Missing(n, d.classes, d.sites, d.quantities, d.source, alone[n]) for n, d in found.items()]
    shown = sensors.stamps(optics.shown(faults(found), time_s))
    episodes = []
    for n, pose in enumerate(seen(values, played(found), found, time_s)):
        track = filmed(pose, shown, rng["noise"])
        action = {name: float(value) for name, value in zip(COMMAND, commands[n], strict=True)}
        episodes.append(Episode(f"push_{n:02d}", task.name, task.hash, action, sensors.START_NS, (track,)))
    noise = {"place_m": PLACE_M, "angle_rad": ANGLE_RAD, "lost": LOST, "rate_hz": RATE_HZ}
    said = answer(task, "push", asked, kind, laws, values, total, noise)
    return World(task.name, tuple(episodes), said)


def physics(values: Mapping[str, float], laws: Mapping[str, Drawn]) -> Physics:
    """Frictions multiply; films add; drives act one after the other."""
    coefficient, every = values["feet@dyna@friction"], tuple(laws.values())

    def friction(feet: Feet) -> Floats:
        force = -coefficient * direction(feet.slip)
        for law in every:
            if law.ratio is not None:
                force = force * law.ratio(feet)
        return np.asarray(force - sum(law.viscous_1s for law in every) / GRAVITY * feet.slip)

    drives = [law.drive for law in every if law.drive is not None]
    return Physics(friction, _chained(drives) if drives else None, sum(law.push_friction for law in every))


def _chained(drives: list[Drive]) -> Drive:
    return drives[0] if len(drives) == 1 else lambda told: drives[1](drives[0](told))


def faults(laws: Mapping[str, Drawn]) -> tuple[optics.Optics, ...]:
    return tuple(law.optics for law in laws.values() if law.optics is not None)


def seen(values: Mapping[str, float], paths: Floats, laws: Mapping[str, Drawn], time_s: Floats) -> list[Floats]:
    """(F, 7) of each push, without noise."""
    bias = np.array([values["env@camera@bias_x"], values["env@camera@bias_y"], 0, 0, 0, 0, 0])
    centre = Rig(values).centre

    def of(path: Floats) -> Floats:
        pose = optics.through(faults(laws), lambda when: tracked(soft.at(path, STEP_S, when), centre), time_s)
        return np.asarray(pose + bias)

    return [of(paths[:, s]) for s in range(paths.shape[1])]


def filmed(pose: Floats, shown: Ints, rng: Generator) -> Track:
    """What a marker on the bar says: noise of place and of orientation, and frames that are lost."""
    keep = sensors.kept(len(pose), LOST, rng)
    place = sensors.noisy(pose[:, :3], PLACE_M, rng)
    wrong = Rotation.from_rotvec(rng.normal(size=(len(pose), 3)) * ANGLE_RAD)
    turned = np.roll((wrong * Rotation.from_quat(np.roll(pose[:, 3:], -1, axis=1))).as_quat(), 1, axis=1)
    turned = turned * np.where(turned[:, :1] < 0, -1.0, 1.0)  # the bar never turns by half a turn
    return Track("bar", "pose", shown[keep], np.concatenate([place, turned], axis=1)[keep])

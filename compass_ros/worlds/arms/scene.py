"""A concealed arm: what is drawn, how it is played, what is recorded, what the answer says."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator

from compass_ros.types import Episode, Floats, Ints, Track
from compass_ros.worlds import draw, sensors
from compass_ros.worlds.arms.arm import Arm, with_values
from compass_ros.worlds.arms.drawing import read
from compass_ros.worlds.arms.draws import Draw, Use
from compass_ros.worlds.arms.law import Law
from compass_ros.worlds.arms.laws.gears import Geared
from compass_ros.worlds.arms.motion import Drive, Played, play
from compass_ros.worlds.arms.motions import AFTER_S, RATE_HZ
from compass_ros.worlds.world import Asked, Kind, Missing, Task, World, answer

_STREAMS = ("kind", "parameters", "motions", "laws", "noise")


@dataclass(frozen=True)
class Sensors:
    """What is measured."""

    noise: float
    """White, of an encoder [rad]."""
    step: float
    """That it counts in [rad]."""
    lost: float = 0.01
    """Probability that a frame is lost."""
    effort_noise: float | None = None
    """White [N m]; None: torques are not measured."""
    effort_step: float = 0.01
    """[N m]"""


@dataclass(frozen=True)
class Motion:
    """What the arms are to do."""

    drive: Drive
    time_s: Floats | None = None
    """(n,) of the commands."""
    targets: Floats | None = None
    """(E, n, J) as they are recorded."""


@dataclass(frozen=True)
class Setup:
    """One kind of arm."""

    name: str
    known: Sequence[Mapping[str, Draw]]
    """Families of laws; two laws of one world are of two families."""
    outside: Mapping[str, Draw]
    motion: Callable[[Arm, Generator], Motion]
    """As it is drawn."""
    sensors: Sensors
    tool: tuple[float, float, float]
    """Where the last link holds things, in its frame [m]."""
    load: tuple[float, float]
    """Lightest and heaviest payload [kg]."""
    torque: tuple[float, ...] | None = None
    """(J,) of gravity on an arm without drives, about [N m]."""
    share: float = 1.0
    """See `Use.share`."""
    told: Callable[[Arm, Floats, Generator], Motion] | None = None
    """The motion of (E, n, J) positions at RATE_HZ; None: nobody drives it."""


def make(setup: Setup, task: Task, asked: Asked) -> World:
    """Draw and play a world. The same task and wishes give the same bits. Raises ConfigError for unknown laws."""
    rng = draw.streams(asked.seed, setup.name, _STREAMS)
    family = {name: str(i) for i, names in enumerate(setup.known) for name in names}
    kind, names = draw.laws(asked, list(family), list(setup.outside), rng["kind"], family)
    values = draw.true_values(task.parameters, rng["parameters"])
    arm = with_values(read(task.model), values)
    motion = setup.motion(arm, rng["motions"])
    plain = play(arm, motion.drive)
    use = _use(setup, arm, plain)
    known = {name: how for family in (*setup.known, setup.outside) for name, how in family.items()}
    laws = _ordered([known[name](use, rng["laws"]) for name in names])
    full = _played(arm, motion.drive, laws) if laws else plain
    said = []
    for law in laws:
        others = [other for other in laws if other is not law]
        without = _played(arm, motion.drive, others) if others else plain
        said.append(replace(law.missing(arm), strength=_strength(setup.sensors, full, without)))
    strength = _strength(setup.sensors, full, plain)
    if asked.commands is not None and setup.told is not None:
        motion = setup.told(arm, asked.commands, rng["motions"])
        full = _played(arm, motion.drive, laws)
    episodes = _episodes(task, setup.sensors, arm, motion, full, rng["noise"])
    return World(task.name, episodes, _answer(task, setup, asked, kind, said, values, strength))


def _answer(
    task: Task, setup: Setup, asked: Asked, kind: Kind, said: Sequence[Missing], values: Mapping[str, float],
    strength: float,
) -> dict[str, object]:  # fmt: skip
    s = setup.sensors
    noise = {"encoder_white_rad": s.noise, "encoder_step_rad": s.step, "lost_frames": s.lost}
    if s.effort_noise is not None:
        noise |= {"effort_white_nm": s.effort_noise, "effort_step_nm": s.effort_step}
    return answer(task, setup.name, asked, kind, said, values, strength, noise)


def _ordered(laws: Sequence[Law]) -> list[Law]:
    """Gears first: they say what the drives turn."""
    return sorted(laws, key=lambda law: not isinstance(law, Geared))


def _played(arm: Arm, drive: Drive, laws: Sequence[Law]) -> Played:
    """With commands as the laws of the command leave them."""
    if drive.told is not None:
        time = np.arange(drive.told.shape[1]) * drive.step_s - drive.before_s
        for law in laws:
            drive = replace(drive, told=law.command(time, drive.told))
    return play(arm, drive, laws)


def _use(setup: Setup, arm: Arm, plain: Played) -> Use:
    rate = np.gradient(plain.angle, 1 / RATE_HZ, axis=1)
    faster = np.gradient(rate, 1 / RATE_HZ, axis=1)
    if setup.torque is None:
        torque = carried = _rms(plain.effort)
    else:
        torque, carried = np.array(setup.torque), arm.dry + arm.armature * _rms(faster)
    noise = sensors.total_noise(setup.sensors.noise, setup.sensors.step)
    return Use(
        arm=arm, torque=torque, carried=carried, peak=np.abs(plain.effort).max(axis=(0, 1)), speed=_rms(rate),
        fastest=np.abs(rate).max(axis=(0, 1)), noise=noise, tool=np.array(setup.tool), load=setup.load,
        share=setup.share,
    )  # fmt: skip


def _rms(series: Floats) -> Floats:
    """(J,) of (E, F, J)."""
    return np.asarray(np.sqrt(np.mean(series**2, axis=(0, 1))))


def _strength(s: Sensors, one: Played, other: Played) -> float:
    count = one.angle.shape[1] - round(AFTER_S * RATE_HZ)
    found = sensors.strength(one.angle[:, :count], other.angle[:, :count], sensors.total_noise(s.noise, s.step))
    if s.effort_noise is None:
        return found
    noise = sensors.total_noise(s.effort_noise, s.effort_step)
    torque = sensors.strength(one.effort[:, :count], other.effort[:, :count], noise)
    return float(np.sqrt(0.5 * (found**2 + torque**2)))


def _episodes(task: Task, s: Sensors, arm: Arm, motion: Motion, played: Played, rng: Generator) -> tuple[Episode, ...]:
    count = len(played.time_s) - round(AFTER_S * RATE_HZ)
    found = []
    for e in range(len(played.angle)):
        keep = sensors.kept(count, s.lost, rng)
        offset = round(1e9 * float(motion.drive.session_s[e]))
        stamps = sensors.stamps(played.time_s[:count])[keep] + offset
        shown = sensors.stepped(sensors.noisy(played.angle[e, :count], s.noise, rng), s.step)[keep]
        tracks = [Track("joints", "joint_position", stamps, shown)]
        if s.effort_noise is not None:
            torque = sensors.noisy(played.effort[e, :count], s.effort_noise, rng)
            tracks.append(Track("efforts", "joint_effort", stamps, sensors.stepped(torque, s.effort_step)[keep]))
        found.append(
            Episode(
                f"{task.name}_{e:02d}", task.name, task.hash, {}, sensors.START_NS + offset, tuple(tracks),
                inputs=_inputs(motion, e, offset),
            )
        )  # fmt: skip
    return tuple(found)


def _inputs(motion: Motion, e: int, offset: int) -> tuple[Track, ...]:
    if motion.time_s is None or motion.targets is None:
        return ()
    stamps: Ints = sensors.stamps(motion.time_s) + offset
    return (Track("target", "joint_position", stamps, motion.targets[e]),)

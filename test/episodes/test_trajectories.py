"""What was executed of trajectories, beside a controller written out: at each moment the last message that began."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from compass_ros.episodes import Source, read_episode
from compass_ros.errors import BagError
from compass_ros.types import Floats, Track
from test.episodes.definitions_of_others import others
from test.episodes.robots import JOINTS, MS, START, Logged, header, point, write

COMMANDS = Source("/arm/joint_trajectory", "target", "joint_position", of=JOINTS, drives=True)


@dataclass(frozen=True)
class Sent:
    """A trajectory: when it begins [ms], which joints, its points [ms after that] and values."""

    begin: int
    joints: tuple[str, ...]
    since: tuple[int, ...]
    value: Floats
    stamped: bool = True

    def logged(self) -> Logged:
        store = others()
        at = START + self.begin * MS
        points = [point(store, s * MS, positions=row) for s, row in zip(self.since, self.value, strict=True)]
        kind = store.types["trajectory_msgs/msg/JointTrajectory"]
        return COMMANDS.topic, at, kind(header(store, at if self.stamped else 0), list(self.joints), points)


def controller(sent: Sequence[Sent], joint: str, at: Floats) -> Floats:
    """Where a joint is asked to be at these times [ms]; NaN before it is told."""
    own = [one for one in sent if joint in one.joints]

    def reached(index: int, time: float) -> float:
        one = own[index]
        times, values = list(one.since), one.value[:, one.joints.index(joint)].tolist()
        if times[0] > 0 and index > 0:
            times, values = [0, *times], [reached(index - 1, one.begin), *values]
        return float(np.interp(time - one.begin, times, values))

    out = np.full(len(at), np.nan)
    for i, time in enumerate(at):
        begun = [k for k, one in enumerate(own) if one.begin <= time]
        if begun:
            out[i] = reached(begun[-1], float(time))
    return out


def read(folder: Path, sent: Sequence[Sent]) -> Track:
    return read_episode(write(folder / "bag", [one.logged() for one in sent]), [COMMANDS]).inputs[0]


def random_sent(seed: int) -> list[Sent]:
    """Eight messages: some while the one before still runs, some for two joints only, some that begin at once."""
    rng = np.random.default_rng(seed)
    begins = np.cumsum(rng.integers(50, 900, 8))
    out = [Sent(0, JOINTS, (0,), rng.normal(size=(1, 3)))]
    for i, begin in enumerate(begins):
        joints = JOINTS if i % 3 else tuple(rng.permutation(JOINTS)[:2].tolist())
        since = np.cumsum(rng.integers(20, 200, int(rng.integers(1, 6)))) - (20 if i % 4 == 0 else 0)
        since = np.maximum(since, 0) if i % 4 else since - since[0]
        value = rng.normal(size=(len(since), len(joints)))
        out.append(Sent(int(begin), joints, tuple(since.tolist()), value, bool(i % 2)))
    return out


@pytest.mark.parametrize("seed", range(6))
def test_later_trajectories_replace_what_is_still_to_come(tmp_path: Path, seed: int) -> None:
    sent = random_sent(seed)
    track = read(tmp_path, sent)
    times = np.arange(0.0, 9000.0, 7.0) + 0.25  # not at a jump
    for column, joint in enumerate(JOINTS):
        seen = ~np.isnan(track.value[:, column])
        since = (track.stamp_ns[seen] - START) / MS
        found = np.interp(times, since, track.value[seen, column])
        np.testing.assert_allclose(found, controller(sent, joint, times), atol=1e-9)


def test_points_of_one_trajectory_are_kept_to_the_last_bit(tmp_path: Path) -> None:
    value = np.random.default_rng(0).normal(size=(30, 3))
    track = read(tmp_path, [Sent(0, JOINTS, tuple(range(0, 600, 20)), value)])
    np.testing.assert_array_equal(track.value, value)
    assert ((track.stamp_ns - START) // MS).tolist() == list(range(0, 600, 20))


def test_a_servo_that_is_sent_single_points(tmp_path: Path) -> None:
    """Each replaces the one before when it comes, long before that one is reached."""
    sent = [Sent(10 * i, JOINTS, (100,), np.full((1, 3), float(i)), stamped=bool(i % 2)) for i in range(20)]
    track = read(tmp_path, sent)
    times = np.arange(0.0, 400.0, 3.0) + 0.5
    seen = (track.stamp_ns - START) / MS
    expected = controller(sent, "lift", times)
    np.testing.assert_allclose(np.interp(times, seen, track.value[:, 0]), expected, atol=1e-9)


def test_points_that_go_back_in_time(tmp_path: Path) -> None:
    with pytest.raises(BagError, match="out of order: the points of lift in the trajectory that begins at"):
        read(tmp_path, [Sent(0, JOINTS, (0, 20, 10), np.zeros((3, 3)))])

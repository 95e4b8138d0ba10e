"""Episodes with inputs and signals: to a bag and back, bit for bit, and as others read that bag."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rosbags.highlevel import AnyReader

from compass_ros.episodes import Source, list_topics, read_episode, write_episode
from compass_ros.errors import BagError
from compass_ros.types import NUMBERS, Episode, Floats, Quantity, Track
from test.episodes.planted import START_NS, assert_same

JOINTS = ("lift", "elbow", "wrist")
FRAMES = 50


def series(name: str, quantity: Quantity, columns: int, seed: int, gaps: float = 0.0, std: bool = False) -> Track:
    """Irregular stamps; some numbers missing where `gaps` says so, never a whole row."""
    rng = np.random.default_rng(seed)
    stamps = START_NS + np.cumsum(rng.integers(1, 3_000_000, FRAMES))
    value = rng.normal(size=(FRAMES, columns)) * 10.0 ** rng.integers(-300, 300, (FRAMES, columns))
    if quantity == "pose" and columns == 7:
        value[:, 3:] = rng.normal(size=(FRAMES, 4)) + 1
    lost = rng.random(value.shape) < gaps
    lost[np.arange(FRAMES), rng.integers(0, columns, FRAMES)] = False
    value[lost] = np.nan
    return Track(name, quantity, stamps, value, rng.uniform(1e-4, 1e-2, FRAMES) if std else None)


JOINED = series("positions", "joint_position", 3, 1, gaps=0.3)
Case = tuple[Source, Track]
TRACKS: tuple[Case, ...] = (
    (Source("/joint_states", "positions", "joint_position", of=JOINTS), JOINED),
    (
        Source("/joint_states", "velocities", "joint_velocity", of=JOINTS),
        replace(series("velocities", "joint_velocity", 3, 2), stamp_ns=JOINED.stamp_ns),
    ),
    (
        Source("/joint_states", "efforts", "joint_effort", of=JOINTS),
        replace(series("efforts", "joint_effort", 3, 3, gaps=0.5), stamp_ns=JOINED.stamp_ns + np.arange(FRAMES) % 2),
    ),
    (Source("/joint_states", "hinge", "joint"), series("hinge", "joint", 1, 4, std=True)),
    (Source("/gyro", "gyro", "gyro"), series("gyro", "gyro", 3, 5)),
    (Source("/imu", "felt", "accelerometer", entry="imu_link"), series("felt", "accelerometer", 3, 6, std=True)),
    (Source("/force", "force", "wrench"), series("force", "wrench", 6, 7)),
    (Source("/tool", "tool", "position"), series("tool", "position", 3, 8, std=True)),
    (Source("/cube", "cube", "pose"), series("cube", "pose", 7, 9)),
)
INPUTS: tuple[Case, ...] = (
    (
        Source("/joint_commands", "target", "joint_position", of=JOINTS, drives=True),
        series("target", "joint_position", 3, 11),
    ),
    (
        Source("/torque", "tool", "joint_effort", of=JOINTS[:1], drives=True),
        series("tool", "joint_effort", 1, 12, std=True),
    ),
    (Source("/voltage", "u", "scalar", of=("left", "right"), drives=True), series("u", "scalar", 2, 13, gaps=0.3)),
    (Source("/base", "base", "twist", of=("wz", "vx"), drives=True), series("base", "twist", 2, 14)),
    (Source("/path", "path", "pose", drives=True), series("path", "pose", 7, 15)),
    (Source("/place", "place", "pose", of=("x", "y", "z"), drives=True), series("place", "pose", 3, 16)),
    (Source("/push", "push", "wrench", of=("fz",), drives=True), series("push", "wrench", 1, 17)),
)


def planted(tracks: tuple[Case, ...] = TRACKS, inputs: tuple[Case, ...] = INPUTS) -> tuple[Episode, list[Source]]:
    own, driven = tuple(track for _, track in tracks), tuple(track for _, track in inputs)
    episode = Episode("run", "arm", "a1b2", {}, START_NS, own, inputs=driven)
    return episode, [source for source, _ in (*tracks, *inputs)]


def same(found: Episode, expected: Episode) -> None:
    assert_same(found, expected)
    assert_same(replace(found, tracks=found.inputs), replace(expected, tracks=expected.inputs))


def test_all_of_them_in_one_bag(tmp_path: Path) -> None:
    episode, sources = planted()
    same(read_episode(write_episode(episode, tmp_path, sources), sources, "arm", "a1b2"), episode)


@pytest.mark.parametrize("case", TRACKS, ids=[track.object for _, track in TRACKS])
def test_each_alone(tmp_path: Path, case: Case) -> None:
    episode, sources = planted((case,), ())
    same(read_episode(write_episode(episode, tmp_path, sources), sources), episode)


@pytest.mark.parametrize("case", INPUTS, ids=[track.object for _, track in INPUTS])
def test_each_input_with_a_signal(tmp_path: Path, case: Case) -> None:
    episode, sources = planted(TRACKS[:1], (case,))
    same(read_episode(write_episode(episode, tmp_path, sources), sources), episode)


def test_joints_share_their_messages(tmp_path: Path) -> None:
    """Positions and velocities of one stamp are one JointState, as rosbags reads it."""
    episode, sources = planted(TRACKS[:2], ())
    bag = write_episode(episode, tmp_path, sources)
    assert {topic.name: topic.messages for topic in list_topics(bag)}["/joint_states"] == FRAMES
    with AnyReader([bag]) as reader:
        wanted = [c for c in reader.connections if c.topic == "/joint_states"]
        said = [reader.deserialize(raw, connection.msgtype) for connection, _, raw in reader.messages(wanted)]
    assert [list(one.name) for one in said] == [[*JOINTS]] * FRAMES  # type: ignore[attr-defined]
    np.testing.assert_array_equal([one.position for one in said], episode.tracks[0].value)  # type: ignore[attr-defined]
    np.testing.assert_array_equal([one.velocity for one in said], episode.tracks[1].value)  # type: ignore[attr-defined]
    assert all(len(one.effort) == 0 for one in said)  # type: ignore[attr-defined]


def numbers(quantity: Quantity) -> Floats:
    return np.zeros((1, len(NUMBERS.get(quantity, ("x",))) + 1))


@pytest.mark.parametrize("quantity", ["joint_position", "wrench", "gyro", "scalar", "pose", "joint"])
def test_numbers_that_have_no_name(tmp_path: Path, quantity: Quantity) -> None:
    track = Track("x", quantity, np.array([START_NS]), numbers(quantity))
    with pytest.raises(BagError, match=rf"x: a {quantity} with \d numbers; expected \d, as its source has it"):
        write_episode(Episode("e", "", "", {}, START_NS, (track,)), tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_two_types_on_one_topic(tmp_path: Path) -> None:
    tracks = (TRACKS[4][1], TRACKS[6][1])
    sources = [Source("/felt", track.object, track.quantity) for track in tracks]
    with pytest.raises(BagError, match="force: /felt holds sensor_msgs/msg/Imu; a wrench needs geometry_msgs"):
        write_episode(Episode("e", "", "", {}, START_NS, tracks), tmp_path, sources)

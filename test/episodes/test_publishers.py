"""Several publishers on one topic, told apart as far as the bag says; stamps of several clocks in one."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import Writer as McapWriter
from rosbags.rosbag1 import Writer as Writer1

from compass_ros.episodes import Source, read_episode
from compass_ros.episodes.definitions import EPISODE_TYPE, embedded_definition, ros1_typestore
from compass_ros.episodes.notes import EpisodeHeader, header_bytes
from compass_ros.episodes.writer import BagWriter
from compass_ros.types import Episode
from test.episodes.definitions_of_others import others
from test.episodes.robots import MS, START, array, header, joint_state, vector, write

KIND = "sensor_msgs/msg/JointState"
Message = tuple[str, int, Sequence[str], float]
"""Publisher, when [ms], joints, the number that all of them have."""
TOPIC = "/joint_states"


def ros1(path: Path, said: Sequence[Message]) -> Path:
    store = ros1_typestore()
    types = store.types
    with Writer1(path.with_suffix(".bag")) as writer:
        known = {
            who: writer.add_connection(TOPIC, KIND, typestore=store, callerid=f"/{who}")
            for who in dict.fromkeys(who for who, *_ in said)
        }
        for i, (who, at, names, number) in enumerate(said):
            stamp = types["builtin_interfaces/msg/Time"](sec=START // 10**9, nanosec=at * MS)
            head = types["std_msgs/msg/Header"](seq=i, stamp=stamp, frame_id="")
            none = np.zeros(0)
            message = types[KIND](head, list(names), np.full(len(names), float(number)), none, none)
            writer.write(known[who], START + i * MS, store.serialize_ros1(message, KIND))
    return path.with_suffix(".bag")


def channels(path: Path, said: Sequence[Message]) -> Path:
    """A channel for each publisher, without their names."""
    store = others()
    with path.with_suffix(".mcap").open("wb") as file:
        writer = McapWriter(file)
        writer.start("ros2")
        schema = writer.register_schema(KIND, "ros2msg", store.generate_msgdef(KIND, ros_version=2)[0].encode())
        known = {who: writer.register_channel(TOPIC, "cdr", schema, {"who": who}) for who, *_ in said}
        for i, (who, at, names, number) in enumerate(said):
            message = joint_state(store, START + at * MS, names, [number] * len(names))
            writer.add_message(known[who], START + i * MS, bytes(store.serialize_cdr(message, KIND)), START + i * MS)
        writer.finish()  # type: ignore[no-untyped-call]
    return path.with_suffix(".mcap")


def frames(path: Path, said: Sequence[Message]) -> Path:
    """One channel; the publishers have frames of their own."""
    store = others()
    logged = [
        (TOPIC, START + i * MS, joint_state(store, START + at * MS, names, [number] * len(names), frame=who))
        for i, (who, at, names, number) in enumerate(said)
    ]
    return write(path, logged)


WRITERS = {"connections of ROS 1": ros1, "channels": channels, "frames": frames}
JOINTS = Source(TOPIC, "arm", "joint_position", of=("a", "b"))
TWO: list[Message] = [
    (who, 5 * i + at, "ab", x + i) for i in range(6) for who, at, x in [("robot", 2, 0.0), ("gui", 0, 100.0)]
]
CASES: dict[str, tuple[list[Message], list[list[float]], str]] = {
    "both say all": (
        [*TWO, ("robot", 90, "ab", 9.0)],
        [[i] * 2 for i in (0, 1, 2, 3, 4, 5, 9)],
        r"and not '.*' \(6 messages\)",
    ),
    "one joint each": (
        [("robot", 2, "a", 1.0), ("gripper", 0, "b", 2.0), ("robot", 12, "a", 3.0), ("gripper", 10, "b", 4.0)],
        [[np.nan, 2], [1, np.nan], [np.nan, 4], [3, np.nan]],
        "",
    ),
    "one after the other": (
        [("first", 0, "ab", 1.0), ("first", 5, "ab", 2.0), ("second", 10, "ab", 3.0)],
        [[1, 1], [2, 2], [3, 3]],
        "",
    ),
    "one joint in both": (
        [*(("robot", 5 * i, "a", i) for i in range(4)), *(("other", 7 * i + 1, "ab", 50 + i) for i in range(3))],
        [[0, np.nan], [np.nan, 50], [1, np.nan], [np.nan, 51], [2, np.nan], [3, 52]],
        r"not '.*' \(3 messages\)",
    ),
    "three": (
        [*((who, 10 * i + k, "ab", 10 * k + i) for i in range(3) for k, who in enumerate("xyz")), ("y", 40, "ab", 19)],
        [[10] * 2, [11] * 2, [12] * 2, [19] * 2],
        r"not '.*' \(3 messages\), '.*' \(3 messages\)",
    ),
}


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("writer", WRITERS)
def test_publishers(tmp_path: Path, writer: str, case: str) -> None:
    logged, expected, remark = CASES[case]
    found = read_episode(WRITERS[writer](tmp_path / "bag", logged), [JOINTS])
    np.testing.assert_array_equal(found.tracks[0].value, expected)
    assert len(found.remarks) == bool(remark)
    assert all(re.search(f"from several publishers at once.*{remark}", said) for said in found.remarks)


COMMAND = Source("/commands", "target", "joint_effort", of=("a", "b"), drives=True)
HOUR = 3600 * 10**9
CLOCKS: dict[str, tuple[Callable[[int], int], int]] = {
    "the same": (lambda t: t, 0),
    "a robot's, since it was switched on": (lambda t: t - START + 7 * 10**9, 0),
    "a simulation's": (lambda t: t - START + 1, 0),
    "a simulation's at half the speed": (lambda t: (t - START) // 2 + 10**9, 0),
    "an hour ahead": (lambda t: t + HOUR, 0),
    "half a second apart": (lambda t: t + HOUR // 7200, -HOUR // 7200),
}


@pytest.mark.parametrize("clock", CLOCKS)
def test_messages_without_a_stamp_are_put_on_the_clock_of_the_others(tmp_path: Path, clock: str) -> None:
    """The same log, its stamps in another clock: commands and positions keep their order and distance."""
    of_robot, unmoved = CLOCKS[clock]
    store = others()
    at = [START + 5 * MS * i for i in range(40)]
    logged = []
    for i, t in enumerate(at):
        logged.append((TOPIC, t, joint_state(store, of_robot(t), "ab", [i, i])))
        logged.append(("/commands", t + 2 * MS, array(store, np.array([i, -i], float))))
    found = read_episode(write(tmp_path / "bag", logged), [JOINTS, COMMAND])
    assert found.tracks[0].stamp_ns.tolist() == [of_robot(t) for t in at]
    since = found.inputs[0].stamp_ns[:-1] - np.array([of_robot(t + 2 * MS) for t in at[:-1]]) - unmoved
    assert np.abs(since).max() <= 1
    assert bool(found.remarks) == (clock not in ("the same", "half a second apart"))
    assert found.start_ns == of_robot(at[0])


def test_a_stamp_that_is_not_set_is_the_logs(tmp_path: Path) -> None:
    store = others()
    twist = store.types["geometry_msgs/msg/TwistStamped"]
    both = store.types["geometry_msgs/msg/Twist"](vector(store, (1, 2, 3)), vector(store, (4, 5, 6)))
    logged = [("/v", START + i * MS, twist(header(store, 0 if i % 2 else START + i * MS), both)) for i in range(6)]
    found = read_episode(write(tmp_path / "bag", logged), [Source("/v", "v", "twist", drives=True)])
    assert found.inputs[0].stamp_ns.tolist() == [START + i * MS for i in range(6)]


def test_inputs_that_stood_before_the_episode_are_used_where_none_came_in_it(tmp_path: Path) -> None:
    """As for an object that was published once: a command that stands."""
    store, kind = others(), "std_msgs/msg/Float64MultiArray"
    writer = BagWriter(tmp_path / "bag")
    command, own = (
        writer.add_topic("/commands", embedded_definition(kind)),
        writer.add_topic(TOPIC, embedded_definition(KIND)),
    )
    head = writer.add_topic("/compass/episode", embedded_definition(EPISODE_TYPE))
    writer.write(command, START, START, bytes(store.serialize_cdr(array(store, np.ones(2)), kind)))
    writer.write(head, START + MS, START + MS, header_bytes(EpisodeHeader("finished", "e", start_ns=START + MS)))
    state = joint_state(store, START + 2 * MS, "ab", [0.5, 0.5])
    writer.write(own, START + 2 * MS, START + 2 * MS, bytes(store.serialize_cdr(state, KIND)))
    writer.close()
    found: Episode = read_episode(writer.folder, [JOINTS, COMMAND])
    assert found.inputs[0].value.tolist() == [[1, 1]]
    assert found.inputs[0].stamp_ns.tolist() == [START]

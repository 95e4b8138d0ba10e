"""What messages say and leave out: what nobody asked for does not matter, what was asked for and lost is said."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.interfaces import Connection
from rosbags.rosbag2 import StoragePlugin, Writer

from compass_ros.episodes import Source, read_episode
from compass_ros.episodes.definitions import typestore
from compass_ros.errors import BagError

T = typestore().types
START = 1_700_000_000_000_000_000
MS = 10**6
NAN = float("nan")


def header(at_ns: int, frame: str = "") -> Any:
    stamp = T["builtin_interfaces/msg/Time"](sec=at_ns // 10**9, nanosec=at_ns % 10**9)
    return T["std_msgs/msg/Header"](stamp=stamp, frame_id=frame)


def joints(at_ms: int, names: Sequence[str], position: Sequence[float], velocity: Sequence[float] = ()) -> object:
    numbers: list[Any] = [np.array(given, float) for given in (position, velocity, ())]
    return T["sensor_msgs/msg/JointState"](header(START + at_ms * MS), list(names), *numbers)


def transform(at_ms: int, child: str, frame: str, x: float, turn: Sequence[float] = (1, 0, 0, 0)) -> object:
    w, i, j, k = (float(number) for number in turn)
    moved = T["geometry_msgs/msg/Vector3"](x=x, y=0.0, z=0.0)
    placed = T["geometry_msgs/msg/Transform"](moved, T["geometry_msgs/msg/Quaternion"](x=i, y=j, z=k, w=w))
    return T["geometry_msgs/msg/TransformStamped"](header(START + at_ms * MS, frame), child, placed)


def bag(folder: Path, topic: str, *messages: object) -> Path:
    """A bag written by rosbags."""
    store = typestore()
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        known: dict[str, Connection] = {}
        for index, message in enumerate(messages):
            kind = str(message.__msgtype__)  # type: ignore[attr-defined]
            if kind not in known:
                known[kind] = writer.add_connection(topic, kind, typestore=store)
            writer.write(known[kind], START + index * MS, store.serialize_cdr(message, kind))
    return folder


OWN = [joints(10 * i, ["swing"], [0.1 * i]) for i in range(4)]
SWING = [Source("/joints", "swing", "joint")]


@pytest.mark.parametrize(
    "other",
    [
        joints(5, ["finger"], [], [0.2]),
        joints(5, ["swing"], [], [0.2]),
        joints(5, [], []),
        joints(5, ["finger", "thumb"], [0.3]),
        joints(5, ["finger", "thumb"], [NAN, 1.0], [0.1]),
        joints(5, [], [0.5]),
    ],
    ids=["another's velocity", "its velocity", "nothing", "another's are too few", "another's is nan", "no names"],
)
def test_joint_states_that_say_nothing_of_the_position(tmp_path: Path, other: object) -> None:
    found = read_episode(bag(tmp_path / "b", "/joints", OWN[0], other, *OWN[1:]), SWING)
    assert found.tracks[0].value[:, 0].tolist() == [0.1 * i for i in range(4)]
    assert found.remarks == ()


def test_joints_come_in_any_order_and_not_all_in_each_message(tmp_path: Path) -> None:
    said = [
        joints(0, ["a", "b"], [1, 2]),
        joints(10, ["b", "a"], [3, 4]),
        joints(20, ["c", "a"], [5, 6]),
        joints(30, ["b"], [7]),
    ]
    found = read_episode(bag(tmp_path / "b", "/joints", *said), [Source("/joints", n, "joint") for n in "abc"])
    assert [found.track(name).value[:, 0].tolist() for name in "abc"] == [[1, 4, 6], [2, 3, 7], [5]]


def test_positions_that_were_asked_for_and_do_not_fit(tmp_path: Path) -> None:
    with pytest.raises(BagError, match="a JointState has 2 names and 1 numbers in its position"):
        read_episode(bag(tmp_path / "b", "/joints", joints(0, ["swing", "x"], [0.1])), SWING)


def test_a_joint_that_is_named_and_never_has_a_position(tmp_path: Path) -> None:
    with pytest.raises(BagError, match="/joints names 'swing', but holds no 'joint' of it"):
        read_episode(bag(tmp_path / "b", "/joints", joints(0, ["swing"], [], [1.0])), SWING)


def test_a_position_that_a_broadcaster_does_not_know(tmp_path: Path) -> None:
    """ros2_control's joint state broadcaster writes NaN for an interface that a joint does not have."""
    found = read_episode(bag(tmp_path / "b", "/joints", OWN[0], joints(5, ["swing"], [NAN]), *OWN[1:]), SWING)
    assert found.tracks[0].value[:, 0].tolist() == [0.1 * i for i in range(4)]
    assert found.remarks == ("1 of 5 messages of swing on /joints are left out (1 without a number): number 2",)


TWO_CAMERAS = [
    transform(10 * i + shift, "cube", frame, x + i)
    for i in range(6)
    for shift, frame, x in [(0, "cam1", 0.0)] + [(1, "/cam2", 100.0)] * (i % 2)
]
CUBE = Source("/tf", "cube", "xyz", entry="cube")


def test_two_frames_are_two_tracks(tmp_path: Path) -> None:
    found = read_episode(bag(tmp_path / "b", "/tf", *TWO_CAMERAS), [CUBE])
    assert (found.tracks[0].frame, found.tracks[0].value[:, 0].tolist()) == ("cam1", [0, 1, 2, 3, 4, 5])
    assert [(t.object, t.frame, t.value[:, 0].tolist()) for t in found.others] == [("cube", "cam2", [101, 103, 105])]
    (remark,) = found.remarks
    assert "cube is seen on /tf in 2 frames, 'cam1' (6 messages), 'cam2' (3 messages): only 'cam1' is used" in remark


@pytest.mark.parametrize("frame", ["cam2", "/cam2"])
def test_the_frame_can_be_chosen(tmp_path: Path, frame: str) -> None:
    source = Source("/tf", "cube", "xyz", entry="cube", frame=frame)
    found = read_episode(bag(tmp_path / "b", "/tf", *TWO_CAMERAS), [source])
    assert found.tracks[0].value[:, 0].tolist() == [101, 103, 105]
    assert found.remarks == ()
    with pytest.raises(BagError, match="cube is not seen in the frame 'cam3', but in cam1, cam2"):
        read_episode(tmp_path / "b", [Source("/tf", "cube", "xyz", entry="cube", frame="cam3")])


def test_other_frames_of_other_things_do_not_matter(tmp_path: Path) -> None:
    said = [m for i in range(3) for m in (transform(i, "cube", "world", i), transform(i, "lid", "cube", 9.0))]
    found = read_episode(bag(tmp_path / "b", "/tf", *said), [CUBE])
    assert (found.tracks[0].value[:, 0].tolist(), found.others, found.remarks) == ([0, 1, 2], (), ())


ZERO = (0, 0, 0, 0)


def test_an_orientation_that_was_never_set(tmp_path: Path) -> None:
    path = bag(tmp_path / "b", "/tf", *(transform(i, "cube", "world", i, ZERO) for i in range(4)))
    with pytest.raises(BagError, match=r"4 with an orientation of zeros.*positions alone are usable: `quantity: xyz`"):
        read_episode(path, [Source("/tf", "cube", "pose")])
    assert read_episode(path, [CUBE]).tracks[0].value[:, 0].tolist() == [0, 1, 2, 3]  # the advice, followed


def test_an_orientation_that_is_lost_now_and_then(tmp_path: Path) -> None:
    turned = [transform(i, "cube", "world", i, ZERO if i in (2, 3) else (0, 1, 0, 0)) for i in range(6)]
    found = read_episode(bag(tmp_path / "b", "/tf", *turned), [Source("/tf", "cube", "pose")])
    assert found.tracks[0].value[:, 0].tolist() == [0, 1, 4, 5]
    said = "2 of 6 messages of cube on /tf are left out (2 with an orientation of zeros): number 3, number 4"
    assert found.remarks == (said,)

"""Tracks and inputs as messages: joints as JointState, everything else as the stamped message that it is made of."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from rosbags.typesys.stores import ros2_jazzy as ros

from compass_ros.episodes.definitions import JOINT_TYPE, POSE_TYPE
from compass_ros.episodes.joint_messages import JOINT_FIELDS
from compass_ros.episodes.notes import encoded, stamped
from compass_ros.episodes.sources import Source
from compass_ros.types import NUMBERS, Floats, Ints, Quantity, Track

_UNKNOWN = np.array([-1.0, *[0.0] * 8])
"""Covariance of what an Imu does not measure, as sensor_msgs has it."""


@dataclass(frozen=True)
class Written:
    """A message to write."""

    stamp_ns: int
    topic: str
    data: bytes


def message_type(quantity: Quantity) -> str:
    """Of the messages that a quantity is written in."""
    return JOINT_TYPE if quantity in JOINT_FIELDS else _SHAPES[quantity].type


def messages(track: Track, source: Source) -> Iterator[Written]:
    """The messages of a track that is of no joints."""
    shape = _SHAPES[track.quantity]
    std = track.std if track.std is not None else np.zeros(len(track.stamp_ns))
    names = source.of or NUMBERS.get(track.quantity, ())
    for stamp, row, sigma in zip(track.stamp_ns.tolist(), track.value.tolist(), std.tolist(), strict=True):
        header = stamped(stamp, track.frame or source.entry or shape.frame)
        said = shape.make(header, dict(zip(names, row, strict=True)), sigma)
        yield Written(stamp, source.topic, encoded(said, shape.type))


def joint_messages(tracks: Sequence[tuple[Track, Source]]) -> Iterator[Written]:
    """One JointState a stamp for tracks of the same joints on one topic: positions, velocities, efforts.

    A number that a row lacks is NaN in it; a quantity without a row at that stamp is an empty array.
    """
    names, topic = list(tracks[0][1].wanted), tracks[0][1].topic
    fields = {JOINT_FIELDS[track.quantity]: track for track, _ in tracks}
    stamps = np.unique(np.concatenate([track.stamp_ns for track, _ in tracks]))
    own = {name: _rows_at(fields.get(name), stamps) for name in ("position", "velocity", "effort")}
    for i, stamp in enumerate(stamps.tolist()):
        numbers = [rows[i] for rows in own.values()]
        said = ros.sensor_msgs__msg__JointState(stamped(stamp), names, *numbers)
        yield Written(stamp, topic, encoded(said, JOINT_TYPE))


def _rows_at(track: Track | None, stamps: Ints) -> list[Floats]:
    """A track's row at each stamp; empty where it has none."""
    none = np.zeros(0)
    if track is None:
        return [none] * len(stamps)
    place = np.searchsorted(track.stamp_ns, stamps)
    there = np.isin(stamps, track.stamp_ns)
    return [np.asarray(track.value[p], float) if here else none for p, here in zip(place, there, strict=True)]


Row = Mapping[str, float]


def _vector(row: Row, letter: str) -> ros.geometry_msgs__msg__Vector3:
    return ros.geometry_msgs__msg__Vector3(*(row.get(f"{letter}{axis}", 0.0) for axis in "xyz"))


def _pose(header: ros.std_msgs__msg__Header, row: Row, std: float) -> object:
    """The identity where the row has no orientation; the covariance holds std^2 for x, y and z."""
    covariance = np.zeros((6, 6))
    covariance[[0, 1, 2], [0, 1, 2]] = std**2
    pose = ros.geometry_msgs__msg__Pose(
        ros.geometry_msgs__msg__Point(*(row.get(axis, 0.0) for axis in "xyz")),
        ros.geometry_msgs__msg__Quaternion(*(row.get(f"q{axis}", float(axis == "w")) for axis in "xyzw")),
    )
    stated = ros.geometry_msgs__msg__PoseWithCovariance(pose, covariance.ravel())
    return ros.geometry_msgs__msg__PoseWithCovarianceStamped(header, stated)


def _twist(header: ros.std_msgs__msg__Header, row: Row, std: float) -> object:
    del std
    twist = ros.geometry_msgs__msg__Twist(_vector(row, "v"), _vector(row, "w"))
    return ros.geometry_msgs__msg__TwistStamped(header, twist)


def _wrench(header: ros.std_msgs__msg__Header, row: Row, std: float) -> object:
    del std
    wrench = ros.geometry_msgs__msg__Wrench(_vector(row, "f"), _vector(row, "t"))
    return ros.geometry_msgs__msg__WrenchStamped(header, wrench)


def _imu(header: ros.std_msgs__msg__Header, row: Row, std: float) -> object:
    del std
    known = {letter: np.zeros(9) if f"{letter}x" in row else _UNKNOWN for letter in "wa"}
    return ros.sensor_msgs__msg__Imu(
        header,
        ros.geometry_msgs__msg__Quaternion(0.0, 0.0, 0.0, 1.0),
        _UNKNOWN,
        _vector(row, "w"),
        known["w"],
        _vector(row, "a"),
        known["a"],
    )


def _list(header: ros.std_msgs__msg__Header, row: Row, std: float) -> object:
    """Without a header: its time is that of the log."""
    del header, std
    plain = ros.std_msgs__msg__MultiArrayLayout([], 0)
    return ros.std_msgs__msg__Float64MultiArray(plain, np.array([*row.values()], float))


@dataclass(frozen=True)
class _Shape:
    type: str
    make: Callable[[ros.std_msgs__msg__Header, Row, float], object]
    """(header, numbers by name, std) -> a message."""
    frame: str = ""
    """Where the track names none."""


_POSED = _Shape(POSE_TYPE, _pose, "table")
_FELT = _Shape("sensor_msgs/msg/Imu", _imu)
_SHAPES: Mapping[Quantity, _Shape] = {
    "xy": _POSED,
    "xyz": _POSED,
    "position": _POSED,
    "pose": _POSED,
    "twist": _Shape("geometry_msgs/msg/TwistStamped", _twist),
    "wrench": _Shape("geometry_msgs/msg/WrenchStamped", _wrench),
    "gyro": _FELT,
    "accelerometer": _FELT,
    "scalar": _Shape("std_msgs/msg/Float64MultiArray", _list),
}

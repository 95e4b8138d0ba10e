"""Where the tracks of an episode come from: topics of a bag, and how their messages become rows of numbers."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np
from rosbags.typesys.stores import ros2_jazzy as ros

from compass_ros.errors import BagError
from compass_ros.types import QUANTITY_SIZE, Quantity


@dataclass(frozen=True)
class Source:
    """Which messages make up the track of one object."""

    topic: str
    object: str
    quantity: Quantity = "xy"
    entry: str = ""
    """TFMessage, TransformStamped: the child frame; JointState: the joint's name. Empty: the object's name, except for
    TransformStamped, where it is any frame."""


def default_sources(objects: Sequence[str], quantity: Quantity = "xy") -> tuple[Source, ...]:
    """The topics of the tracker (`/puck_tracker/<object>/pose`), or `/joint_states` for joints."""
    topic = "/joint_states" if quantity == "joint" else "/puck_tracker/{}/pose"
    return tuple(Source(topic.format(name), name, quantity) for name in objects)


@dataclass(frozen=True)
class Row:
    """One measurement of one object."""

    stamp_ns: int
    value: tuple[float, ...]
    """QUANTITY_SIZE[quantity] numbers as in `types.Track`."""
    std: float | None
    """Standard deviation of the position [m]; None where the message does not state one."""


Position = tuple[float, float, float]
Orientation = tuple[float, float, float, float]


@dataclass(frozen=True)
class _Measurement:
    """What a message says of one named thing: a position and perhaps an orientation, or a joint position."""

    entry: str
    stamp_ns: int
    position: Position | None = None
    orientation: Orientation | None = None
    joint: float | None = None
    std: float | None = None


def rows(message: object, type_name: str, source: Source) -> Iterator[Row]:
    """Rows of a source's track in one deserialised message of a type in KNOWN_TYPES.

    Raises BagError where the message cannot give the quantity (a point has no orientation, a pose no joint position).
    """
    entry = source.entry or (source.object if type_name in _MANY_ENTRIES else "")
    for found in _MEASUREMENTS[type_name](message):
        if not entry or found.entry in ("", entry):
            yield Row(found.stamp_ns, _value(found, type_name, source), found.std)


def entries(message: object, type_name: str) -> set[str]:
    """What a message that holds several things calls them: joints, frames."""
    return {found.entry for found in _MEASUREMENTS[type_name](message) if found.entry}


def _value(found: _Measurement, type_name: str, source: Source) -> tuple[float, ...]:
    if source.quantity == "joint" and found.joint is not None:
        return (found.joint,)
    if source.quantity in ("xy", "xyz") and found.position is not None:
        return found.position[: QUANTITY_SIZE[source.quantity]]
    if source.quantity == "pose" and found.position is not None and found.orientation is not None:
        return (*found.position, *found.orientation)
    raise BagError(f"{source.topic}: a {type_name} holds no '{source.quantity}' of {source.object}")


def _stamp_ns(header: ros.std_msgs__msg__Header) -> int:
    return int(header.stamp.sec) * 10**9 + int(header.stamp.nanosec)


def _position(point: ros.geometry_msgs__msg__Point | ros.geometry_msgs__msg__Vector3) -> Position:
    return (point.x, point.y, point.z)


def _orientation(rotation: ros.geometry_msgs__msg__Quaternion) -> Orientation:
    return (rotation.w, rotation.x, rotation.y, rotation.z)


def _position_std(covariance: Sequence[float]) -> float | None:
    """Standard deviation in the plane from a 6 x 6 row-major covariance; None where it states none (0 or negative)."""
    variance = float(covariance[0] + covariance[7]) / 2
    return None if variance <= 0 else math.sqrt(variance)


def _pose_stamped(message: object) -> Iterable[_Measurement]:
    pose = cast(ros.geometry_msgs__msg__PoseStamped, message)
    stamp = _stamp_ns(pose.header)
    yield _Measurement("", stamp, _position(pose.pose.position), _orientation(pose.pose.orientation))


def _pose_with_covariance(message: object) -> Iterable[_Measurement]:
    """PoseWithCovarianceStamped and Odometry: both have a header and a pose with covariance."""
    stamped = cast(ros.geometry_msgs__msg__PoseWithCovarianceStamped, message)
    pose = stamped.pose.pose
    std = _position_std(cast(Sequence[float], stamped.pose.covariance))
    yield _Measurement("", _stamp_ns(stamped.header), _position(pose.position), _orientation(pose.orientation), std=std)


def _point_stamped(message: object) -> Iterable[_Measurement]:
    point = cast(ros.geometry_msgs__msg__PointStamped, message)
    yield _Measurement("", _stamp_ns(point.header), _position(point.point))


def _transform_stamped(message: object) -> Iterable[_Measurement]:
    stamped = cast(ros.geometry_msgs__msg__TransformStamped, message)
    transform = stamped.transform
    frame = stamped.child_frame_id.lstrip("/")
    position, orientation = _position(transform.translation), _orientation(transform.rotation)
    yield _Measurement(frame, _stamp_ns(stamped.header), position, orientation)


def _transforms(message: object) -> Iterable[_Measurement]:
    for stamped in cast(ros.tf2_msgs__msg__TFMessage, message).transforms:
        yield from _transform_stamped(stamped)


def _joint_state(message: object) -> Iterable[_Measurement]:
    state = cast(ros.sensor_msgs__msg__JointState, message)
    if len(state.name) != len(state.position):
        raise BagError(f"a JointState has {len(state.name)} names and {len(state.position)} positions")
    for name, position in zip(state.name, np.asarray(state.position, float), strict=True):
        yield _Measurement(name, _stamp_ns(state.header), joint=float(position))


_MEASUREMENTS: dict[str, Callable[[object], Iterable[_Measurement]]] = {
    "geometry_msgs/msg/PoseStamped": _pose_stamped,
    "geometry_msgs/msg/PoseWithCovarianceStamped": _pose_with_covariance,
    "geometry_msgs/msg/PointStamped": _point_stamped,
    "geometry_msgs/msg/TransformStamped": _transform_stamped,
    "tf2_msgs/msg/TFMessage": _transforms,
    "tf/msg/tfMessage": _transforms,
    "nav_msgs/msg/Odometry": _pose_with_covariance,
    "sensor_msgs/msg/JointState": _joint_state,
}

_MANY_ENTRIES = frozenset({"tf2_msgs/msg/TFMessage", "tf/msg/tfMessage", "sensor_msgs/msg/JointState"})

KNOWN_TYPES = frozenset(_MEASUREMENTS)
"""Message types that can give a track."""

"""Where the tracks of an episode come from: topics of a bag, and how their messages become rows of numbers."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal, cast

import numpy as np
from rosbags.typesys.stores import ros2_jazzy as ros

from compass_ros.episodes.definitions import JOINT_TYPE
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
    frame: str = ""
    """Positions: those in this frame (`header.frame_id`) make up the track; empty: the one with most messages."""


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
    frame: str = ""
    """Frame of a position; empty where the message names none."""


Part = Literal["position", "orientation", "joint position"]
_PARTS: Mapping[Quantity, tuple[Part, ...]] = {
    "xy": ("position",),
    "xyz": ("position",),
    "pose": ("position", "orientation"),
    "joint": ("joint position",),
}
"""The parts of a measurement that a quantity's numbers come from, in their order."""


@dataclass(frozen=True)
class _Measurement:
    """What a message says of one named thing."""

    entry: str
    frame: str
    stamp_ns: int
    parts: Mapping[Part, tuple[float, ...]]
    """Those that the message holds: position (x, y, z), orientation (w, x, y, z), joint position (one number)."""
    std: float | None = None


@dataclass(frozen=True)
class _Extractor:
    """How the messages of one type are read."""

    gives: frozenset[Part]
    """What such a message can hold."""
    read: Callable[[object, str], Iterable[_Measurement]]
    """(message, entry) -> what it says of this entry; of all its entries where `entry` is empty."""
    many: bool = False
    """A message holds several things by name."""


def rows(message: object, type_name: str, source: Source) -> Iterator[Row]:
    """Rows of a source's track in one deserialised message of a type in KNOWN_TYPES.

    None where the message says nothing of the object, or not this quantity of it (a JointState with velocities only).

    Raises:
        BagError: Messages of this type never hold the quantity (a point has no orientation, a pose no joint position),
            or this one cannot be understood.
    """
    extractor = EXTRACTORS[type_name]
    wanted = _PARTS[source.quantity]
    if not extractor.gives.issuperset(wanted):
        raise BagError(f"{source.topic}: a {type_name} holds no '{source.quantity}' of {source.object}")
    for found in extractor.read(message, source.entry or (source.object if extractor.many else "")):
        if found.parts.keys() >= set(wanted):
            numbers = [number for part in wanted for number in found.parts[part]]
            yield Row(found.stamp_ns, tuple(numbers[: QUANTITY_SIZE[source.quantity]]), found.std, found.frame)


def entries(message: object, type_name: str) -> set[str]:
    """What a message that holds several things calls them: joints, frames."""
    return {found.entry for found in EXTRACTORS[type_name].read(message, "") if found.entry}


def plain_frame(frame: str) -> str:
    """A frame without the slash that tf of ROS 1 put before it."""
    return frame.lstrip("/")


def _stamp_ns(header: ros.std_msgs__msg__Header) -> int:
    return int(header.stamp.sec) * 10**9 + int(header.stamp.nanosec)


def _position(point: ros.geometry_msgs__msg__Point | ros.geometry_msgs__msg__Vector3) -> tuple[float, ...]:
    return (point.x, point.y, point.z)


def _orientation(rotation: ros.geometry_msgs__msg__Quaternion) -> tuple[float, ...]:
    return (rotation.w, rotation.x, rotation.y, rotation.z)


def _position_std(covariance: Sequence[float]) -> float | None:
    """Standard deviation in the plane from a 6 x 6 row-major covariance; None where it states none (0 or negative)."""
    variance = float(covariance[0] + covariance[7]) / 2
    return None if variance <= 0 else math.sqrt(variance)


def _at(header: ros.std_msgs__msg__Header, pose: ros.geometry_msgs__msg__Pose, std: float | None) -> _Measurement:
    parts: Mapping[Part, tuple[float, ...]] = {
        "position": _position(pose.position),
        "orientation": _orientation(pose.orientation),
    }
    return _Measurement("", plain_frame(header.frame_id), _stamp_ns(header), parts, std)


def _pose_stamped(message: object, entry: str) -> Iterable[_Measurement]:
    del entry  # it holds one thing
    stamped = cast(ros.geometry_msgs__msg__PoseStamped, message)
    yield _at(stamped.header, stamped.pose, None)


def _pose_with_covariance(message: object, entry: str) -> Iterable[_Measurement]:
    """PoseWithCovarianceStamped and Odometry: both have a header and a pose with covariance."""
    del entry
    stamped = cast(ros.geometry_msgs__msg__PoseWithCovarianceStamped, message)
    yield _at(stamped.header, stamped.pose.pose, _position_std(cast(Sequence[float], stamped.pose.covariance)))


def _point_stamped(message: object, entry: str) -> Iterable[_Measurement]:
    del entry
    stamped = cast(ros.geometry_msgs__msg__PointStamped, message)
    parts: Mapping[Part, tuple[float, ...]] = {"position": _position(stamped.point)}
    yield _Measurement("", plain_frame(stamped.header.frame_id), _stamp_ns(stamped.header), parts)


def _transform_stamped(message: object, entry: str) -> Iterable[_Measurement]:
    stamped = cast(ros.geometry_msgs__msg__TransformStamped, message)
    child, header, transform = plain_frame(stamped.child_frame_id), stamped.header, stamped.transform
    if plain_frame(entry) in ("", child):
        parts: Mapping[Part, tuple[float, ...]] = {
            "position": _position(transform.translation),
            "orientation": _orientation(transform.rotation),
        }
        yield _Measurement(child, plain_frame(header.frame_id), _stamp_ns(header), parts)


def _transforms(message: object, entry: str) -> Iterable[_Measurement]:
    for stamped in cast(ros.tf2_msgs__msg__TFMessage, message).transforms:
        yield from _transform_stamped(stamped, entry)


def _joint_state(message: object, entry: str) -> Iterable[_Measurement]:
    """An array without data is empty, as sensor_msgs/JointState allows; one of another length is not understood."""
    state = cast(ros.sensor_msgs__msg__JointState, message)
    positions = np.asarray(state.position, float)
    fits = len(positions) == len(state.name)
    for index in [i for i, name in enumerate(state.name) if entry in ("", name)]:
        if entry and len(positions) and not fits:
            raise BagError(f"a JointState has {len(state.name)} names and {len(positions)} positions")
        parts: Mapping[Part, tuple[float, ...]] = {"joint position": (float(positions[index]),)} if fits else {}
        yield _Measurement(state.name[index], "", _stamp_ns(state.header), parts)


_POSE: frozenset[Part] = frozenset({"position", "orientation"})

EXTRACTORS: Mapping[str, _Extractor] = {
    "geometry_msgs/msg/PoseStamped": _Extractor(_POSE, _pose_stamped),
    "geometry_msgs/msg/PoseWithCovarianceStamped": _Extractor(_POSE, _pose_with_covariance),
    "geometry_msgs/msg/PointStamped": _Extractor(frozenset({"position"}), _point_stamped),
    "geometry_msgs/msg/TransformStamped": _Extractor(_POSE, _transform_stamped),
    "tf2_msgs/msg/TFMessage": _Extractor(_POSE, _transforms, many=True),
    "tf/msg/tfMessage": _Extractor(_POSE, _transforms, many=True),
    "nav_msgs/msg/Odometry": _Extractor(_POSE, _pose_with_covariance),
    JOINT_TYPE: _Extractor(frozenset({"joint position"}), _joint_state, many=True),
}

KNOWN_TYPES = frozenset(EXTRACTORS)
"""Message types that can give a track."""

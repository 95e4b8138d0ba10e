"""Which types of messages give a source its rows, and how: one table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from compass_ros.episodes import joint_messages as joints
from compass_ros.episodes import spatial_messages as spatial
from compass_ros.episodes.columns import Columns, LacksError, MessageKind, Number
from compass_ros.episodes.definitions import JOINT_TYPE
from compass_ros.episodes.layout import Layout
from compass_ros.episodes.sources import Source
from compass_ros.errors import BagError, nearest

_LISTS = frozenset(
    f"std_msgs/msg/{kind}{size}{many}"
    for kind, sizes in (("Float", (32, 64)), ("Int", (8, 16, 32, 64)), ("UInt", (8, 16, 32, 64)))
    for size in sizes
    for many in ("", "MultiArray")
)
"""Messages of numbers that have no names."""
_POSE = spatial.of_one(position="pose.position", orientation="pose.orientation")
_STATED = {"position": "pose.pose.position", "orientation": "pose.pose.orientation"}
_TRAJECTORY = MessageKind(joints.trajectory, lambda layout: layout.names("joint_names"))
_DOFS = MessageKind(joints.dof_states, joints.dof_names)

KINDS: Mapping[str, MessageKind] = {
    "geometry_msgs/msg/Pose": spatial.of_one(position="position", orientation="orientation"),
    "geometry_msgs/msg/PoseStamped": _POSE,
    "geometry_msgs/msg/PoseWithCovarianceStamped": spatial.of_one("pose.covariance", **_STATED),
    "geometry_msgs/msg/PointStamped": spatial.of_one(position="point"),
    "geometry_msgs/msg/TransformStamped": spatial.transforms(),
    "tf2_msgs/msg/TFMessage": spatial.transforms(),
    "tf/msg/tfMessage": spatial.transforms(),
    "nav_msgs/msg/Odometry": spatial.of_one(
        "pose.covariance", **_STATED, linear="twist.twist.linear", angular="twist.twist.angular"
    ),
    "geometry_msgs/msg/Twist": spatial.of_one(linear="linear", angular="angular"),
    "geometry_msgs/msg/TwistStamped": spatial.of_one(linear="twist.linear", angular="twist.angular"),
    "geometry_msgs/msg/Wrench": spatial.of_one(force="force", torque="torque"),
    "geometry_msgs/msg/WrenchStamped": spatial.of_sensor(force="wrench.force", torque="wrench.torque"),
    "sensor_msgs/msg/Imu": spatial.of_sensor(
        {"gyro": "angular_velocity_covariance", "accelerometer": "linear_acceleration_covariance"},
        angular="angular_velocity",
        acceleration="linear_acceleration",
    ),
    JOINT_TYPE: MessageKind(joints.joint_state, lambda layout: layout.names("name")),
    "trajectory_msgs/msg/JointTrajectory": _TRAJECTORY,
    "control_msgs/msg/JointTrajectoryControllerState": MessageKind(joints.controller_state, _TRAJECTORY.entries),
    "control_msgs/msg/DynamicJointState": MessageKind(joints.interfaces, _TRAJECTORY.entries),
    "control_msgs/msg/SingleDOFStateStamped": _DOFS,
    "control_msgs/msg/MultiDOFStateStamped": _DOFS,
    "control_msgs/msg/MultiDOFCommand": MessageKind(joints.dof_commands, lambda layout: layout.names("dof_names")),
    **dict.fromkeys(sorted(_LISTS), MessageKind(joints.numbers_in_order)),
}
"""By type. Numbers in other messages are named by their paths."""


def columns(layout: Layout, type_name: str, source: Source) -> list[Columns]:
    """Rows of a source in a message of a layout; none where the message says nothing of it.

    Raises:
        BagError: Messages of this type never hold the quantity (a point has no orientation, a pose no joint position),
            or this one cannot be understood.
    """
    try:
        if type_name in KINDS and (source.quantity != "scalar" or type_name in _LISTS):
            found = [one for one in KINDS[type_name].columns(layout, source) if any(one.numbers)]
            _check_paths(layout, found)
            return found
    except LacksError:
        raise BagError(f"{source.topic}: a {type_name} holds no '{source.quantity}' of {source.object}") from None
    except KeyError as error:
        raise BagError(f"{source.topic}: as this bag defines a {type_name}, it has no {error.args[0]}") from error
    except BagError as error:
        raise BagError(f"{source.topic}: {error}") from error
    return [_by_path(layout, type_name, source)]


def readable(type_name: str, source: Source) -> bool:
    """Whether messages of a type can be read for a source, as far as the type says it."""
    return type_name in KINDS or source.quantity in (*joints.JOINT_FIELDS, "scalar")


def entries(layout: Layout, type_name: str) -> Sequence[str]:
    """What a message calls the things that it holds."""
    return KINDS[type_name].entries(layout) if type_name in KINDS else ()


def _check_paths(layout: Layout, found: Sequence[Columns]) -> None:
    """Raises KeyError for a path that the definition lacks."""
    for one in found:
        paths = [number[0] for number in one.numbers if number is not None]
        paths += [f"{one.header}.stamp.{part}" for part in ("sec", "nanosec") if one.header]
        paths += [f"{one.since}.{part}" for part in ("sec", "nanosec") if one.since]
        for path in paths + [path for path in (one.covariance, one.unknown) if path]:
            layout.places[path]


def _by_path(layout: Layout, type_name: str, source: Source) -> Columns:
    """Numbers that the source calls by their path in the message, as in `motors[2].q` or `torque[0]`."""
    numbers = [_number(layout, name) for name in source.wanted]
    for name, number in zip(source.wanted, numbers, strict=True):
        if number is None:
            known = [path for path, place in layout.places.items() if place.count]
            listed = f"{', '.join(known[:12])}{', ...' * (len(known) > 12)}"
            said = f"of a {type_name} `of` names numbers, as {listed}; found '{name}'{nearest(name, known)}"
            raise BagError(f"{source.topic}: {said}")
    return Columns(tuple(numbers), "header" if "header.stamp.sec" in layout.places else "")


def _number(layout: Layout, name: str) -> Number | None:
    """The number at a path; of an array the first, or that of the index."""
    if layout.count(name):
        return name, 0
    path, _, index = name.removesuffix("]").rpartition("[")
    return (path, int(index)) if index.isdecimal() and int(index) < layout.count(path) else None

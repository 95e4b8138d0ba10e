"""Message definitions: text, type hash, and (de)serialisation without ROS.

Two sources. What a recorder writes beside raw bytes is the text that is installed with ROS (`share/PKG/msg`), put
together as rosbag2 does it. What this package itself serialises needs no ROS: the standard types come with rosbags, and
the two of `compass_ros_interfaces` that a bag holds are written out below; a test compares them with that package.
"""

from __future__ import annotations

import json
import os
import re
import sys
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from compass_ros.errors import BagError

SHOT_TYPE = "compass_ros_interfaces/msg/ShotCommand"
EPISODE_TYPE = "compass_ros_interfaces/msg/EpisodeInfo"
SHOT_TYPES = frozenset({SHOT_TYPE, "compass_interfaces/msg/ShotCommand"})
EPISODE_TYPES = frozenset({EPISODE_TYPE, "compass_interfaces/msg/EpisodeInfo"})
"""As written, and under the name that the interface package had in version 0.1."""
STRING_TYPE = "std_msgs/msg/String"
POSE_TYPE = "geometry_msgs/msg/PoseWithCovarianceStamped"
JOINT_TYPE = "sensor_msgs/msg/JointState"

COMPASS_MESSAGES = {
    SHOT_TYPE: """\
std_msgs/Header header
string cell
string[] names
float64[] values
""",
    EPISODE_TYPE: """\
uint8 RECORDING=0
uint8 FINISHED=1
uint8 DISCARDED=2
uint8 RECOVERED=3
uint8 FAILED=4
std_msgs/Header header
uint8 state
string episode
string cell
string cell_hash
string bag
builtin_interfaces/Duration duration
uint64 messages
string[] topics
string message
""",
}

_TYPE_NAME = re.compile(r"([A-Za-z]\w*)/msg/([A-Za-z]\w*)")
_FIELD_TYPE = re.compile(r"^\s*([A-Za-z][\w/]*)(?:<=\d+)?(?:\[[^\]]*\])?\s+[A-Za-z]\w*", re.MULTILINE)
_PRIMITIVE = re.compile(r"bool|byte|char|w?string|float(32|64)|u?int(8|16|32|64)")


@dataclass(frozen=True)
class Definition:
    """What a bag must say about a message type so that others can read it."""

    type: str
    """`package/msg/Name`."""
    text: str
    """The .msg text with its dependencies appended (schema encoding `ros2msg`)."""
    digest: str
    """Type hash, `RIHS01_...`; empty when not known."""
    encoding: str = "ros2msg"


@cache
def typestore() -> Typestore:
    """ROS 2 Jazzy's standard types and the messages of `compass_ros_interfaces` that a bag holds."""
    store = get_typestore(Stores.ROS2_JAZZY)
    for current, names in ((SHOT_TYPE, SHOT_TYPES), (EPISODE_TYPE, EPISODE_TYPES)):
        for name in names:
            store.register(get_types_from_msg(COMPASS_MESSAGES[current], name))
    return store


@cache
def ros1_typestore() -> Typestore:
    """ROS 1 Noetic's standard types and tf, under their ROS 2 names."""
    store = get_typestore(Stores.ROS1_NOETIC)
    for name in ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage"):
        store.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", name))
    return store


@cache
def embedded_definition(type_name: str) -> Definition:
    """Definition of a type in `typestore()`: the same on every machine, whatever ROS it has."""
    text, _ = typestore().generate_msgdef(type_name, ros_version=2)
    return Definition(type_name, text, typestore().hash_rihs01(type_name))


@cache
def installed_definition(type_name: str) -> Definition:
    """Definition of a type as installed with ROS on this machine. Raises BagError when it is not installed."""
    return Definition(type_name, _full_text(type_name), _installed_digest(type_name))


def _full_text(type_name: str) -> str:
    """Text of a type and its dependencies: depth first, alphabetically in each message, each once (rosbag2's order)."""
    seen: set[str] = set()

    def append(name: str) -> str:
        text = _share_file(name, ".msg")
        package = name.split("/", 1)[0]
        parts = [text]
        for dependency in _dependencies(text, package):
            if dependency not in seen:
                seen.add(dependency)
                depending = dependency.replace("/", "/msg/", 1)
                parts.append(f"\n{'=' * 80}\nMSG: {dependency}\n{append(depending)}")
        return "".join(parts)

    return append(type_name)


def _dependencies(text: str, package: str) -> list[str]:
    """Message types that the fields of a message have, as `package/Name`, sorted."""
    without_comments = re.sub(r"#.*", "", text)
    names = {name for name in _FIELD_TYPE.findall(without_comments) if not _PRIMITIVE.fullmatch(name)}
    return sorted(name if "/" in name else f"{package}/{name}" for name in names)


def _installed_digest(type_name: str) -> str:
    hashes = json.loads(_share_file(type_name, ".json"))["type_hashes"]
    return str(next(entry["hash_string"] for entry in hashes if entry["type_name"] == type_name))


def _share_file(type_name: str, suffix: str) -> str:
    match = _TYPE_NAME.fullmatch(type_name)
    if match is None:
        raise BagError(f"'{type_name}' is not a message type; expected 'package/msg/Name'")
    package, name = match.groups()
    prefixes = [*filter(None, os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)), sys.prefix]
    for prefix in prefixes:
        path = Path(prefix, "share", package, "msg", name + suffix)
        if path.is_file():
            return path.read_text(encoding="utf-8")
    where = f"share/{package}/msg/{name}{suffix}"
    raise BagError(
        f"no definition of {type_name} is installed: the package {package} is missing, or its workspace was not "
        f"sourced; looked for {where} in {', '.join(prefixes)}"
    )

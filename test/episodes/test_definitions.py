"""Message definitions: against the interface package's sources, the installed hashes, and rosbags' own parser."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from compass_ros.episodes.definitions import (
    COMPASS_MESSAGES,
    EPISODE_TYPE,
    POSE_TYPE,
    SHOT_TYPE,
    embedded_definition,
    installed_definition,
)
from compass_ros.errors import BagError

ROOT = Path(__file__).parents[2]
SHARE = Path(sys.prefix, "share")
SEPARATOR = "=" * 80

needs_ros = pytest.mark.skipif(not (SHARE / "geometry_msgs").exists(), reason="no ROS interfaces in this environment")


@pytest.mark.parametrize("kind", COMPASS_MESSAGES)
def test_embedded_messages_are_those_of_the_interface_package(kind: str) -> None:
    name = kind.rsplit("/", 1)[1]
    source = (ROOT / "msg_schemas" / "msg" / f"{name}.msg").read_text(encoding="utf-8")
    store = get_typestore(Stores.ROS2_JAZZY)
    store.register(get_types_from_msg(source, kind))
    assert store.hash_rihs01(kind) == embedded_definition(kind).digest


@needs_ros
@pytest.mark.parametrize(
    "kind", ["geometry_msgs/msg/PoseStamped", "nav_msgs/msg/Odometry", POSE_TYPE, "sensor_msgs/msg/Image"]
)
def test_installed_hash_is_the_one_that_rosbags_computes(kind: str) -> None:
    assert installed_definition(kind).digest == embedded_definition(kind).digest


@needs_ros
@pytest.mark.parametrize(
    "kind", ["nav_msgs/msg/Odometry", "visualization_msgs/msg/MarkerArray", "sensor_msgs/msg/JointState"]
)
def test_installed_text_parses_to_the_same_types(kind: str) -> None:
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(installed_definition(kind).text, kind))
    assert store.hash_rihs01(kind) == installed_definition(kind).digest


@needs_ros
def test_dependencies_come_in_the_order_of_rosbag2() -> None:
    """Depth first, alphabetical in each message (a std::set there), each once, named without `msg/`."""
    text = installed_definition("geometry_msgs/msg/PoseStamped").text
    named = [part.split("\n", 1)[0] for part in text.split(f"\n{SEPARATOR}\nMSG: ")[1:]]
    assert named == [
        "geometry_msgs/Pose",
        "geometry_msgs/Point",
        "geometry_msgs/Quaternion",
        "std_msgs/Header",
        "builtin_interfaces/Time",
    ]
    assert text.startswith((SHARE / "geometry_msgs" / "msg" / "PoseStamped.msg").read_text())


@needs_ros
@pytest.mark.ros
@pytest.mark.parametrize("kind", [SHOT_TYPE, EPISODE_TYPE])
def test_the_built_interfaces_have_the_embedded_hash(kind: str) -> None:
    hashes = json.loads((SHARE / f"{kind}.json").read_text())["type_hashes"]
    assert hashes[0]["hash_string"] == embedded_definition(kind).digest


@pytest.mark.parametrize(
    "kind", ["../../etc/msg/passwd", "geometry_msgs/PoseStamped", "a/msg/../b", "geometry_msgs/msg/Pos"]
)
def test_what_is_no_installed_type_is_refused(kind: str) -> None:
    with pytest.raises(BagError, match=r"not a message type|no definition of"):
        installed_definition(kind)

"""The Foxglove layout names topics, fields and services that exist: those of the nodes as they run."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from compass_ros_interfaces.msg import CalibrationStatus, EpisodeInfo, Mismatch
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid
from sensor_msgs.msg import Image
from visualization_msgs.msg import MarkerArray

from test.nodes.conftest import StartNode
from test.nodes.harness import Probe, until

pytestmark = pytest.mark.ros
LAYOUT = Path(__file__).parents[2] / "config" / "foxglove_layout.json"
KINDS = {
    "geometry_msgs/msg/PoseWithCovarianceStamped": PoseWithCovarianceStamped,
    "compass_ros_interfaces/msg/CalibrationStatus": CalibrationStatus,
    "compass_ros_interfaces/msg/Mismatch": Mismatch,
    "compass_ros_interfaces/msg/EpisodeInfo": EpisodeInfo,
    "diagnostic_msgs/msg/DiagnosticArray": DiagnosticArray,
    "nav_msgs/msg/OccupancyGrid": OccupancyGrid,
    "sensor_msgs/msg/Image": Image,
    "visualization_msgs/msg/MarkerArray": MarkerArray,
}


def strings(value: Any) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict):
        for key, one in value.items():
            yield key
            yield from strings(one)
    elif isinstance(value, list):
        for one in value:
            yield from strings(one)


def panels(layout: Any) -> set[str]:
    """Names of all panels in the tree of the layout."""
    if isinstance(layout, str):
        return {layout}
    return panels(layout["first"]) | panels(layout["second"])


def test_every_panel_has_its_settings_and_its_place() -> None:
    content = json.loads(LAYOUT.read_text())
    assert panels(content["layout"]) == set(content["configById"])


def test_every_name_exists(start_node: StartNode, probe: Probe, tmp_path: Path) -> None:
    paths = {text for text in strings(json.loads(LAYOUT.read_text())["configById"]) if text.startswith("/")}
    start_node("puck_tracker")
    start_node("recorder", directory=str(tmp_path / "bags"), min_free_mb=1)
    start_node("calibrator", output=str(tmp_path / "result"), versions=str(tmp_path / "versions"))

    def missing() -> set[str]:
        topics = dict(probe.node.get_topic_names_and_types())
        services = {name for name, _ in probe.node.get_service_names_and_types()}
        left = set()
        for path in paths - services:
            topic, *fields = path.split(".")
            message: Any = KINDS[topics[topic][0]]() if topic in topics else None
            for field in fields:
                message = getattr(message, field, None)
            if message is None:
                left.add(path)
        return left

    until(lambda: missing() == set(), f"what the layout names: {missing()}")

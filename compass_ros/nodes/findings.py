"""What a calibration has found, as latched topics: parameters, causal graph, mismatch."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from compass_ros_interfaces.action import Calibrate
from compass_ros_interfaces.msg import CausalGraph, Mismatch, SimParameters
from rclpy.node import Node
from std_msgs.msg import Header

from compass_ros.nodes import convert
from compass_ros.nodes.qos import LATCHED
from compass_ros.nodes.requests import one_line
from compass_ros.reporting.result_json import read_result


class Findings:
    """Topics of a configured calibrator; they belong to the node."""

    def __init__(self, node: Node, frame: str) -> None:
        """`frame`: of positions in the cell."""
        self._node = node
        self._frame = frame
        self._parameters = node.create_publisher(SimParameters, "~/sim_parameters", LATCHED)
        self._graph = node.create_publisher(CausalGraph, "~/causal_graph", LATCHED)
        self._mismatch = node.create_publisher(Mismatch, "~/mismatch", LATCHED)

    def publish(self, path: Path) -> Mapping[str, Any]:
        """Show a result.json; its content. Raises ConfigError when it cannot be read."""
        result = read_result(path)
        for said in (*result.get("warnings", ()), *convert.left_out(result)):
            self._node.get_logger().warning(one_line(said))
        header = Header(stamp=self._node.get_clock().now().to_msg(), frame_id=self._frame)
        self._parameters.publish(convert.parameters_message(result, header, str(path)))
        self._graph.publish(convert.graph_message(result, header))
        self._mismatch.publish(convert.mismatch_message(result, header))
        return result


def answer(result: Mapping[str, Any], path: Path, message: str) -> Calibrate.Result:
    """The action's answer of a calibration that has ended well."""
    return Calibrate.Result(
        success=True,
        message=message,
        result_json=str(path),
        gap_nominal=convert.mean_gap(result, "nominal"),
        gap_calibrated=convert.mean_gap(result, "calibrated"),
        unit=convert.unit(result),
        verdict=result["mismatch"]["verdict"],
        sentence=result["mismatch"]["sentence"],
        left_out=convert.left_out(result),
    )

"""The operator's side of the calibrator: proposals, versions, the running check, and what there is to see.

What simulates runs in one thread beside the executor, one thing after the other; services answer at once.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from datetime import datetime, timezone
from pathlib import Path

from compass_ros_interfaces.msg import SimParameter, SimParameters
from diagnostic_msgs.msg import DiagnosticStatus
from nav_msgs.msg import OccupancyGrid
from rclpy.node import Node
from std_msgs.msg import Header
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

from compass_ros.errors import CompassError
from compass_ros.nodes.diagnostic import diagnostic
from compass_ros.nodes.qos import LATCHED
from compass_ros.nodes.requests import one_line
from compass_ros.nodes.seeing import grid_message, markers_message
from compass_ros.operation.desk import Desk
from compass_ros.operation.mismatch_map import mismatch_map
from compass_ros.operation.running_check import Verdict
from compass_ros.reporting.result_json import read_result

CELL_SIZE_M = 0.02


class Operator:
    """Services and topics of a configured calibrator. Entities belong to the node; `close` ends the thread."""

    def __init__(self, node: Node, desk: Desk, checking: bool, unit: str, frame: str) -> None:
        """`checking`: compare new episodes with the simulator in force; `unit` of their gaps, `frame` of positions."""
        self._node = node
        self._desk = desk
        self._checking = checking
        self._unit = unit
        self._frame = frame
        self._worker = ThreadPoolExecutor(1, thread_name_prefix="operator")
        self._verdict: Verdict | None = None
        self._problem = ""
        self._applied_topic = node.create_publisher(SimParameters, "~/applied_parameters", LATCHED)
        self._map_topic = node.create_publisher(OccupancyGrid, "~/mismatch_map", LATCHED)
        self._markers_topic = node.create_publisher(MarkerArray, "~/markers", LATCHED)
        node.create_service(Trigger, "~/apply", self._on_apply)
        node.create_service(Trigger, "~/revert", self._on_revert)
        node.create_service(Trigger, "~/next_experiment", self._on_next_experiment)

    def begin(self) -> None:
        """Say what is in force, and begin to check. Raises ConfigError where the versions are damaged."""
        self._say_applied()
        if self._checking:
            self._later(self._desk.renew)

    def close(self) -> None:
        self._worker.shutdown(cancel_futures=True)

    def propose(self, result: Path) -> None:
        """A calibration has ended well; its map and markers follow."""
        self._desk.result = result
        self._submit(self._show)

    def take(self, bag: str) -> None:
        """An episode of this cell has been recorded."""
        if self._checking:
            self._later(lambda: self._desk.take(Path(bag)))

    def drop(self, bag: str) -> None:
        """An episode of this cell was discarded after its end."""
        if self._checking:
            self._later(lambda: self._desk.drop(Path(bag)))

    def health(self, name: str) -> DiagnosticStatus:
        """For /diagnostics: what is in force, what is proposed, how the check stands."""
        try:
            applied, proposal = str(self._desk.applied()), self._desk.proposal()
            problem = self._problem
        except CompassError as error:
            applied, proposal, problem = "unknown", None, str(error)
        values = {"applied": applied, "proposed": "" if proposal is None else str(proposal)}
        verdict = self._verdict
        message = "no check" if not self._checking else "the check begins"
        level = DiagnosticStatus.OK
        if verdict is not None:
            values |= {
                "episodes checked": str(verdict.episodes),
                f"gap of the newest [{self._unit}]": f"{verdict.newest_gap:.5f}",
                "evidence that the gap has grown": f"{verdict.e_value:.3g}",
            }
            message = verdict.sentence
            level = DiagnosticStatus.WARN if verdict.alarm else DiagnosticStatus.OK
        if proposal is not None:
            message += "; parameters are proposed: look at the report, then call ~/apply"
        if problem:
            level, message = DiagnosticStatus.WARN, f"{message}; {problem}"
        return diagnostic(f"{name}: simulator in force", level, message, values)

    def _on_apply(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        def apply() -> str:
            now = datetime.fromtimestamp(self._node.get_clock().now().nanoseconds * 1e-9, timezone.utc)
            version = self._desk.apply(now.isoformat(timespec="seconds"))
            return f"applied: {version}, in {version.folder}"

        return self._change(apply, response)

    def _on_revert(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        return self._change(lambda: f"reverted to {self._desk.revert()}", response)

    def _on_next_experiment(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        return self._answer(self._desk.next_experiment, response)

    def _change(self, work: Callable[[], str], response: Trigger.Response) -> Trigger.Response:
        self._answer(work, response)
        if response.success:
            self._node.get_logger().info(response.message)
            self.begin()
        return response

    def _answer(self, work: Callable[[], str], response: Trigger.Response) -> Trigger.Response:
        try:
            response.message, response.success = one_line(work()), True
        except CompassError as error:
            response.message, response.success = one_line(str(error)), False
        return response

    def _say_applied(self) -> None:
        version, values = self._desk.applied(), self._desk.values()
        rows = [
            SimParameter(
                name=p.name, unit=p.unit, default_value=p.default, value=values[p.name], std=float("nan"),
                lower=p.low, upper=p.high, active=values[p.name] != p.default,
            )
            for p in self._desk.cell.parameters
        ]  # fmt: skip
        source = str(version.folder) if version.number else str(version)
        self._applied_topic.publish(
            SimParameters(header=self._header(), cell=self._desk.cell.name, source=source, parameters=rows)
        )

    def _later(self, work: Callable[[], Verdict]) -> None:
        """A step of the check; its verdict is said when it becomes an alarm."""

        def check() -> None:
            before, self._verdict = self._verdict, work()
            if self._verdict.alarm and (before is None or not before.alarm):
                self._node.get_logger().warning(self._verdict.sentence)

        self._submit(check)

    def _submit(self, work: Callable[[], None]) -> None:
        def watched() -> None:
            try:
                work()
                self._problem = ""
            except CompassError as error:
                self._problem = one_line(str(error))
                self._node.get_logger().warning(self._problem)

        self._worker.submit(watched).add_done_callback(_raise)

    def _show(self) -> None:
        if not any(spec.quantity != "joint" for spec in self._desk.cell.objects):
            return  # joints have no place
        result = read_result(self._desk.result / "result.json")
        residuals = self._desk.residuals()
        floor_m = result["gap"]["noise_floor_m"] or 0.0
        found = mismatch_map(residuals, CELL_SIZE_M)
        self._map_topic.publish(grid_message(found, floor_m, self._header()))
        self._markers_topic.publish(markers_message(residuals, result["mismatch"], self._header()))

    def _header(self) -> Header:
        return Header(stamp=self._node.get_clock().now().to_msg(), frame_id=self._frame)


def _raise(done: Future[None]) -> None:
    """What nobody expected is not swallowed by the thread."""
    if not done.cancelled():
        done.result()

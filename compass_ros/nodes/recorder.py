"""Node `recorder`: one rosbag2 MCAP bag an episode, with the bytes of any topics as they were received."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import rclpy
from builtin_interfaces.msg import Duration, Time
from compass_interfaces.msg import EpisodeInfo
from compass_interfaces.srv import StartEpisode, StopEpisode
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_srvs.srv import Trigger

from compass_ros.episodes.notes import STATES, EpisodeHeader
from compass_ros.episodes.recording import Recorder
from compass_ros.episodes.writer import sync_bag
from compass_ros.errors import BagError, CompassError
from compass_ros.nodes.topic_watch import TopicWatch

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
DISCOVERY_PERIOD_S = 0.2
STATUS_PERIOD_S = 1.0

DEFAULT_TOPICS = ["/puck_tracker/puck1/pose", "/puck_tracker/puck2/pose", "/virtual_cell/shot"]


class RecorderNode(Node):
    """Receives from the moment it starts, and writes while an episode runs: to start one takes no discovery."""

    def __init__(self) -> None:
        super().__init__("recorder")
        self._declare()
        self._recorder = Recorder(
            Path(self._text("directory")).expanduser(),
            min_free_bytes=self._whole("min_free_mb") * 10**6,
            max_duration_ns=self._whole("max_duration_s") * 10**9,
        )
        self._syncing = ThreadPoolExecutor(1)  # the disk may take its time; the answer to `stop` may not
        self._status_topic = self.create_publisher(EpisodeInfo, "~/status", LATCHED)
        self._diagnostics_topic = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self.create_service(StartEpisode, "~/start_episode", self._on_start)
        self.create_service(StopEpisode, "~/stop_episode", self._on_stop)
        self.create_service(Trigger, "~/discard_episode", self._on_discard)
        self._watch = TopicWatch(
            self,
            [self.resolve_topic_name(topic) for topic in self.get_parameter("topics").value],
            depth=self._whole("depth"),
            connected=self._recorder.connect,
            received=self._on_message,
        )
        self.create_timer(DISCOVERY_PERIOD_S, self._watch.update)
        self.create_timer(STATUS_PERIOD_S, self._on_tick)
        if self._recorder.status.message:
            self.get_logger().warning(self._recorder.status.message)

    def _declare(self) -> None:
        def declare(name: str, default: object, text: str) -> None:
            self.declare_parameter(name, default, ParameterDescriptor(description=text, read_only=True))

        declare(
            "topics", DEFAULT_TOPICS, "names of the topics to record, of any type; relative ones are in the namespace"
        )
        declare("directory", "out/episodes", "folder of the bags; this node holds it alone")
        declare("depth", 1000, "messages of a topic that wait here when the disk is slow [count]")
        declare("min_free_mb", 500, "an episode is not started with less on the disk [MB]")
        declare("max_duration_s", 600, "an episode that nobody stops is ended after this [s]; 0: never")
        declare("cell", "", "name of the cell, where the start service does not say it")
        declare("cell_hash", "", "hash of the cell's configuration, where the start service does not say it")

    def _text(self, name: str) -> str:
        return str(self.get_parameter(name).value)

    def _whole(self, name: str) -> int:
        return int(self.get_parameter(name).value)

    def _now_ns(self) -> int:
        return int(self.get_clock().now().nanoseconds)

    def _on_message(self, topic: str, data: bytes, published_ns: int, sequence: int | None) -> None:
        try:
            self._recorder.take(topic, data, self._now_ns(), published_ns, sequence)
        except BagError:
            self.get_logger().error(self._recorder.status.message)
            self._say()

    def _on_start(self, request: StartEpisode.Request, response: StartEpisode.Response) -> StartEpisode.Response:
        try:
            cell, cell_hash = request.cell or self._text("cell"), request.cell_hash or self._text("cell_hash")
            action = dict(zip(request.action_names, request.action_values, strict=True))
            status = self._recorder.start(request.episode, cell, cell_hash, action, self._now_ns())
        except (BagError, ValueError) as error:
            response.message = str(error)
            return response
        response.success, response.bag, response.message = True, status.bag, f"recording {status.episode}"
        self._say()
        return response

    def _on_stop(self, request: StopEpisode.Request, response: StopEpisode.Response) -> StopEpisode.Response:
        del request  # empty
        try:
            status = self._recorder.stop()
            response.success, response.message = True, status.message
            self._say()
            self._syncing.submit(sync_bag, Path(status.bag))
        except BagError as error:
            response.message = str(error)
        response.info = _message(self._recorder.status)
        return response

    def _on_discard(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        del request  # empty
        try:
            status = self._recorder.discard()
            response.success, response.message = True, f"discarded {status.episode}"
            self._say()
        except BagError as error:
            response.message = str(error)
        return response

    def _on_tick(self) -> None:
        if self._recorder.overdue(self._now_ns()):
            try:
                self._recorder.stop(f"ended by itself after {self._whole('max_duration_s')} s")
            except BagError as error:
                self.get_logger().error(str(error))
            self._say()
        elif self._recorder.recording:
            self._say()
        self._diagnose()

    def _say(self) -> None:
        self._status_topic.publish(_message(self._recorder.progress()))

    def _diagnose(self) -> None:
        status = self._recorder.progress()
        missing = self._watch.problems()
        values = {"state": status.state, "episode": status.episode, **self._recorder.counts()}
        try:
            values["free on disk [MB]"] = self._recorder.free_bytes() // 10**6
        except BagError as error:
            missing = (*missing, str(error))
        problems = [*missing, *filter(None, [status.message])]
        level = DiagnosticStatus.ERROR if status.state == "failed" else DiagnosticStatus.WARN
        report = DiagnosticStatus(
            level=level if problems else DiagnosticStatus.OK,
            name=f"{self.get_fully_qualified_name()}: episodes",
            message="; ".join(problems) or status.state,
            values=[KeyValue(key=str(key), value=str(value)) for key, value in values.items()],
        )
        stamped = DiagnosticArray(status=[report])
        stamped.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics_topic.publish(stamped)

    def destroy_node(self) -> None:
        self._recorder.close()
        self._syncing.shutdown()
        super().destroy_node()


def _message(status: EpisodeHeader) -> EpisodeInfo:
    message = EpisodeInfo(
        state=STATES.index(status.state),
        episode=status.episode,
        cell=status.cell,
        cell_hash=status.cell_hash,
        bag=status.bag,
        messages=status.messages,
        topics=list(status.topics),
        message=status.message,
    )
    message.header.frame_id = "table"
    message.header.stamp = Time(sec=status.start_ns // 10**9, nanosec=status.start_ns % 10**9)
    message.duration = Duration(sec=status.duration_ns // 10**9, nanosec=status.duration_ns % 10**9)
    return message


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the node until it is told to end; an episode that runs then stays without an end and can be recovered."""
    rclpy.init(args=arguments)
    try:
        node = RecorderNode()
    except CompassError as error:
        rclpy.logging.get_logger("recorder").fatal(str(error))
        rclpy.try_shutdown()
        return 1
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
    return 0


if __name__ == "__main__":
    raise SystemExit(main())

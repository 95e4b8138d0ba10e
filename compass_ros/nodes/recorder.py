"""Node `recorder`: one rosbag2 MCAP bag an episode, with the bytes of any topics as they were received."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

from compass_ros_interfaces.msg import EpisodeInfo
from compass_ros_interfaces.srv import StartEpisode, StopEpisode
from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.msg import IntegerRange
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.exceptions import NameValidationException
from rclpy.validate_full_topic_name import validate_full_topic_name
from std_srvs.srv import Trigger

from compass_ros.episodes.recording import Recorder
from compass_ros.episodes.rolling import Rolling
from compass_ros.episodes.writer import sync_bag
from compass_ros.errors import BagError, shown
from compass_ros.nodes.managed import ManagedNode
from compass_ros.nodes.qos import LATCHED
from compass_ros.nodes.recorder_messages import episode_message, health_message
from compass_ros.nodes.requests import checked_action, checked_text, one_line, wrong_text
from compass_ros.nodes.run import ROS_ERRORS, run
from compass_ros.nodes.stepped import Stepped
from compass_ros.nodes.topic_patterns import example, is_pattern, topic_pattern
from compass_ros.nodes.topic_watch import TopicWatch

FETCH_PERIOD_S = 0.01
"""How often the queues are emptied: 100 looks at the node in a second cost 4 % of a processor, whatever comes. Messages
have the time at which they came."""
DISCOVERY_PERIOD_S = 0.2
STATUS_PERIOD_S = 1.0

DEFAULT_TOPICS = ["puck_tracker/puck1/pose", "puck_tracker/puck2/pose", "virtual_cell/shot"]


class RecorderNode(ManagedNode):
    """Receives from the moment it is active, and writes while an episode runs: to start one takes no discovery.

    Configured it holds its folder. It cannot be deactivated while an episode runs. When it is shut down in an episode,
    the bag stays without an end and can be recovered.
    """

    def __init__(self) -> None:
        super().__init__("recorder")
        self._recorder: Recorder | None = None
        self._rolling: Rolling | None = None
        self._saving = False
        self._declare()

    def _declare(self) -> None:
        declare = self.declare_fixed
        topics = "topics to record, of any type: names, and patterns as /arm/* for what there is and what comes; "
        topics += "relative ones are in the namespace (names can be remapped), and the bag has them from the root"
        declare("topics", DEFAULT_TOPICS, topics, self._wrong_topics)
        self.declare_data_dir()
        folder = "folder of the bags; this node holds it alone; empty: `episodes` in data_dir"
        declare("directory", "", folder, wrong_text)

        def whole(name: str, default: int, text: str, least: int, most: int) -> None:
            declare(name, default, text, integer_range=[IntegerRange(from_value=least, to_value=most, step=1)])

        whole("depth", 5000, "messages of a topic that wait here when disk or processor are slow [count]", 1, 1_000_000)
        whole("min_free_mb", 500, "an episode is not started with less on the disk [MB]", 0, 10**9)
        whole("max_duration_s", 600, "an episode that nobody stops is ended after this [s]; 0: never", 0, 10**8)
        whole("buffer_s", 0, "the last seconds are kept in memory, for ~/save_last [s]; 0: nothing", 0, 86_400)
        whole("buffer_mb", 256, "memory of that at most; while it is saved, twice as much [MB]", 1, 10**6)
        declare("cell", "", "name of the cell, where the start service does not say it", wrong_text)
        hashed = "hash of the cell's configuration, where the start service does not say it"
        declare("cell_hash", "", hashed, wrong_text)

    def configure(self) -> None:
        """Raises BagError: the folder cannot be written, or another recorder holds it."""
        span_s, most_mb = self._whole("buffer_s"), self._whole("buffer_mb")
        self._rolling = Rolling(span_s * 10**9, most_mb * 10**6) if span_s else None
        self._recorder = Recorder(
            self.place("directory", "episodes"),
            min_free_bytes=self._whole("min_free_mb") * 10**6,
            max_duration_ns=self._whole("max_duration_s") * 10**9,
            rolling=self._rolling,
        )
        self._syncing = ThreadPoolExecutor(1)  # the disk may take its time; the answer to `stop` may not
        self._status_topic = self.create_publisher(EpisodeInfo, "~/status", LATCHED)
        self._diagnostics_topic = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self.create_service(StartEpisode, "~/start_episode", self._on_start)
        self.create_service(StopEpisode, "~/stop_episode", self._on_stop)
        self.create_service(Trigger, "~/discard_episode", self._on_discard)
        beside = MutuallyExclusiveCallbackGroup()  # what comes in the meantime is taken
        self.create_service(Trigger, "~/save_last", self._on_save_last, callback_group=beside)
        given: list[str] = self.get_parameter("topics").value
        self._watch = TopicWatch(
            self,
            {self.resolve_topic_name(topic): _recorded(topic) for topic in given if not is_pattern(topic)},
            [topic_pattern(topic, self.get_namespace()) for topic in given if is_pattern(topic)],
            depth=self._whole("depth"),
            connected=self._recorder.connect,
            received=self._on_message,
        )
        self._received = 0
        self.every(FETCH_PERIOD_S, self._on_fetch)
        self.every(DISCOVERY_PERIOD_S, self._on_discovery)
        self.every(STATUS_PERIOD_S, self._on_tick)
        if self._recorder.status.message:
            self.get_logger().warning(self._recorder.status.message)

    def deactivate(self) -> None:
        """Raises BagError while an episode runs, or is saved."""
        if self._saving:
            raise BagError("the last seconds are being saved; wait for the answer")
        if self._running.recording:
            raise BagError(f"episode {self._running.status.episode} is being recorded; stop or discard it first")

    def problems(self) -> list[str]:
        watched = self._watch.problems() if self.active else ()
        return [*super().problems(), *watched, *self._scarcity(), *self._short()]

    def tell(self) -> None:
        if self._recorder is not None:
            self._say()

    def cleanup(self) -> None:
        if self._recorder is not None:
            self._recorder.close()
            self._syncing.shutdown()
        self._recorder = None

    @property
    def _running(self) -> Recorder:
        if self._recorder is None:
            raise BagError("the recorder is not configured")
        return self._recorder

    def _text(self, name: str) -> str:
        return str(self.get_parameter(name).value)

    def _whole(self, name: str) -> int:
        return int(self.get_parameter(name).value)

    def _now_ns(self) -> int:
        return int(self.get_clock().now().nanoseconds)

    def _fetched_ns(self) -> int:
        """Now, when all is taken that came before."""
        until_ns = self._watch.fetch()
        return self._now_ns() if self.get_clock().ros_time_is_active else until_ns

    def _scarcity(self) -> list[str]:
        """What is wrong with the folder."""
        if self._recorder is None:
            return []
        try:
            free, asked = self._recorder.free_bytes() // 10**6, self._whole("min_free_mb")
        except BagError as error:
            return [str(error)]
        return [f"{free} MB left on the disk, {asked} MB are asked for"] if free < asked else []

    def _short(self) -> list[str]:
        """What is wrong with the last seconds."""
        if self._rolling is None or not self._rolling.short:
            return []
        covered, wanted = self._rolling.covered_ns * 1e-9, self._whole("buffer_s")
        return [f"only the last {covered:.1f} s of {wanted} fit into buffer_mb: {self._whole('buffer_mb')}"]

    def _wrong_topics(self, topics: Sequence[str]) -> str:
        if not topics:
            return "expected one topic or more, found none"
        for topic in topics:
            if is_pattern(topic) and topic.startswith("~"):
                return f"{shown(topic)} is no pattern of topics: expected one from the root, or in the namespace"
            try:
                validate_full_topic_name(self.resolve_topic_name(example(topic)))
            except (NameValidationException, *ROS_ERRORS) as error:
                return f"{shown(topic)} is no name of a topic: {one_line(str(error).split(', at ')[0])}"
        return ""

    def _on_fetch(self) -> None:
        self._watch.fetch()

    def _on_discovery(self) -> None:
        if self.active:
            self._watch.update()

    def _on_message(self, topic: str, data: bytes, received_ns: int, published_ns: int, sequence: int | None) -> None:
        self._received += 1
        log_ns = self._now_ns() if self.get_clock().ros_time_is_active else received_ns
        try:
            self._running.take(topic, data, log_ns, published_ns, sequence)
        except BagError:
            self.get_logger().error(self._running.status.message)
            self._say()

    def _on_start(self, request: StartEpisode.Request, response: StartEpisode.Response) -> StartEpisode.Response:
        try:
            if not self.active:
                raise BagError(f"the recorder is {self.state}; activate it first")
            cell = checked_text(request.cell, "cell") or self._text("cell")
            cell_hash = checked_text(request.cell_hash, "cell_hash") or self._text("cell_hash")
            self._watch.update()  # latched topics: who has published so far
            status = self._running.start(request.episode, cell, cell_hash, checked_action(request), self._fetched_ns())
        except BagError as error:
            response.message = str(error)
            return response
        response.success, response.bag, response.message = True, status.bag, f"recording {status.episode}"
        self._say()
        return response

    def _on_stop(self, request: StopEpisode.Request, response: StopEpisode.Response) -> StopEpisode.Response:
        del request  # empty
        try:
            status = self._running.stop(now_ns=self._fetched_ns())
            if status.message:
                self.get_logger().warning(f"{status.episode}: {status.message}")
            response.success, response.message = True, status.message
            self._say()
            self._syncing.submit(sync_bag, Path(status.bag))
        except BagError as error:
            response.message = str(error)
        response.info = episode_message(self._running.status)
        return response

    def _on_discard(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        del request  # empty
        try:
            status = self._running.discard()
            response.success, response.message = True, f"discarded {status.episode}"
            self._say()
        except BagError as error:
            response.message = str(error)
        return response

    async def _on_save_last(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        del request  # empty
        try:
            folder, past = self._running.last(self._fetched_ns())
            self._saving = True
            saved = await Stepped(past.writing(folder, self._text("cell"), self._text("cell_hash")), self.executor.wake)
            self._syncing.submit(sync_bag, folder)
            what = f"the last {saved.duration_ns * 1e-9:.1f} s, {saved.messages} messages"
            response.success, response.message = True, "; ".join(filter(None, [f"{saved.bag}: {what}", saved.message]))
            self.get_logger().info(response.message)
        except BagError as error:
            response.message = str(error)
        finally:
            self._saving = False
        return response

    def _on_tick(self) -> None:
        if self._running.overdue(self._now_ns()):
            try:
                self._running.stop(f"ended by itself after {self._whole('max_duration_s')} s", self._now_ns())
            except BagError as error:
                self.get_logger().error(str(error))
            self._say()
        elif self._running.recording:
            self._say()
        self._diagnose()

    def _say(self) -> None:
        self._status_topic.publish(episode_message(self._running.progress(), self.problems()))

    def _diagnose(self) -> None:
        status, problems = self._running.progress(), self.problems()
        values = {
            "state": status.state,
            "episode": status.episode,
            "messages received in the last second": self._received,
            "lost messages": self._running.lost,
            **self._running.counts(),
        }
        if self._rolling is not None:
            values["kept for save_last [s]"] = round(self._rolling.covered_ns * 1e-9, 1)
        self._received = 0
        with suppress(BagError):  # `problems` has said so
            values["free on disk [MB]"] = self._running.free_bytes() // 10**6
        report = health_message(self.get_fully_qualified_name(), status, values, problems)
        stamped = DiagnosticArray(status=[report])
        stamped.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics_topic.publish(stamped)


def _recorded(topic: str) -> str:
    """A topic's name in the bag: the same in every namespace, and whatever it is remapped to."""
    return topic if topic.startswith(("/", "~")) else f"/{topic}"


def main() -> None:
    run(RecorderNode, "recorder")


if __name__ == "__main__":
    main()

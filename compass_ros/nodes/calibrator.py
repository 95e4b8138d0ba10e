"""Node `calibrator`: simulator parameters, causal graph and mismatch from recorded bags, as an action and as topics."""

from __future__ import annotations

import math
import threading
from pathlib import Path

import rclpy
from compass_interfaces.action import Calibrate
from compass_interfaces.msg import CalibrationStatus, CausalGraph, EpisodeInfo, Mismatch, SimParameters
from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.msg import IntegerRange, ParameterDescriptor
from rclpy.action import ActionClient, ActionServer, CancelResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Header
from std_srvs.srv import Trigger

from compass_ros.errors import CompassError, ConfigError
from compass_ros.nodes import convert
from compass_ros.nodes.job import Job, Outcome, Request
from compass_ros.reporting.result_json import read_result

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
POLL_S = 0.05
"""[s] How often a running calibration is looked at: delay of its progress and of a cancel."""


class BusyError(CompassError):
    """A calibration is running, and another one was asked for."""


class Calibrator(Node):
    """Every calibration is a goal of the action `~/calibrate`, also those that the service or the start asks for."""

    def __init__(self) -> None:
        super().__init__("calibrator")
        self._declare()
        self._recorded: list[str] = []
        self._running: Job | None = None
        self._claim = threading.Lock()

        self._parameters_topic = self.create_publisher(SimParameters, "~/sim_parameters", LATCHED)
        self._graph_topic = self.create_publisher(CausalGraph, "~/causal_graph", LATCHED)
        self._mismatch_topic = self.create_publisher(Mismatch, "~/mismatch", LATCHED)
        self._status_topic = self.create_publisher(CalibrationStatus, "~/status", LATCHED)
        self._diagnostics_topic = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self._status = CalibrationStatus()
        self._say(convert.status_message(CalibrationStatus.IDLE, self._header()))

        self.create_subscription(EpisodeInfo, "recorder/status", self._on_episode, 100)
        self._action_server = ActionServer(
            self,
            Calibrate,
            "~/calibrate",
            self._execute,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
            callback_group=ReentrantCallbackGroup(),
        )
        self._own_client = ActionClient(self, Calibrate, "~/calibrate")
        self.create_service(Trigger, "~/recalibrate", self._on_recalibrate)
        self.create_timer(1.0, self._diagnose)
        self._start_timer = self.create_timer(0.1, self._on_start)

    def _declare(self) -> None:
        def describe(text: str, **extra: object) -> ParameterDescriptor:
            return ParameterDescriptor(description=text, **extra)

        natural = [IntegerRange(from_value=0, to_value=2**63 - 1, step=1)]
        # One path is accepted where a list is expected, hence the dynamic type.
        paths = "paths of bags, or of folders that hold bags: one, or a list; empty: only what the recorder finishes"
        self.declare_parameter("bags", "", describe(paths, dynamic_typing=True))
        self.declare_parameter("cell", "air_hockey", describe("name of a cell, or path of its YAML"))
        self.declare_parameter("seed", 0, describe("seed of all random numbers", integer_range=natural))
        rollouts = "budget of simulated rollouts [count]; 0: the method's default"
        self.declare_parameter("rollouts", 0, describe(rollouts, integer_range=natural))
        self.declare_parameter("method", "default", describe("as `compass calibrate --method`"))
        output = "folder of the result; an earlier result there is replaced when the new one is complete"
        self.declare_parameter("output", "out/calibration", describe(output))
        self.declare_parameter("autostart", True, describe("calibrate when the node starts, if `bags` names any"))

    def _header(self, frame: str = "") -> Header:
        return Header(stamp=self.get_clock().now().to_msg(), frame_id=frame)

    def _bags(self) -> tuple[str, ...]:
        value = self.get_parameter("bags").value
        bags = [value] if isinstance(value, str) else list(value or ())
        if not all(isinstance(bag, str) for bag in bags):
            raise ConfigError(f"bags: expected a path or a list of paths, found {value!r}")
        return tuple(bag for bag in bags if bag)

    def _request(self, goal: Calibrate.Goal) -> Request:
        """What the goal asks for; the node's parameters where it leaves a field empty."""
        bags = tuple(goal.bags) or (*self._bags(), *self._recorded)
        if not bags:
            raise ConfigError("no bags: name them in the goal or in the parameter `bags`, or record episodes")
        return Request(
            bags=bags,
            cell=goal.cell or self.get_parameter("cell").value,
            seed=goal.seed or self.get_parameter("seed").value,
            rollouts=goal.rollouts or self.get_parameter("rollouts").value,
            output=Path(goal.output or self.get_parameter("output").value),
            method=self.get_parameter("method").value,
        )

    def _begin(self, goal: Calibrate.Goal) -> Job:
        """Raises BusyError when a calibration is running, ConfigError when this one cannot start."""
        with self._claim:
            self._refuse_a_second()
            self._running = Job.start(self._request(goal))
            self._say(convert.status_message(CalibrationStatus.RUNNING, self._header()))
            return self._running

    def _refuse_a_second(self) -> None:
        if self._running is not None:
            raise BusyError(f"refused: a calibration is already running ({self._status.share_done:.0%} done)")

    def _execute(self, handle: ServerGoalHandle) -> Calibrate.Result:
        try:
            job = self._begin(handle.request)
        except BusyError as error:  # the running one keeps the status
            handle.abort()
            return self._without_result(str(error))
        except CompassError as error:
            return self._fail(handle, str(error))
        try:
            self._follow(job, handle)
            return self._end(handle, job)
        except CompassError as error:
            return self._fail(handle, str(error))
        finally:
            self._running = None

    def _end(self, handle: ServerGoalHandle, job: Job) -> Calibrate.Result:
        """Say how a job has ended. Raises ConfigError when its result cannot be read."""
        if not rclpy.ok(context=self.context):
            return self._without_result(job.message)  # nobody can be told any more
        if job.outcome is Outcome.FAILED:
            return self._fail(handle, job.message)
        if job.outcome is Outcome.CANCELLED:
            self._say(convert.status_message(CalibrationStatus.CANCELLED, self._header(), message=job.message))
            handle.canceled()
            return self._without_result(job.message)
        answer = self._publish(job.output / "result.json", job.message)
        self._say(convert.status_message(CalibrationStatus.SUCCEEDED, self._header(), message=job.message))
        handle.succeed()
        return answer

    def _fail(self, handle: ServerGoalHandle, message: str) -> Calibrate.Result:
        self.get_logger().error(message)
        self._say(convert.status_message(CalibrationStatus.FAILED, self._header(), message=message))
        handle.abort()
        return self._without_result(message)

    def _follow(self, job: Job, handle: ServerGoalHandle) -> None:
        """Hand on progress until the job has ended; a cancel, or the end of the node, ends it."""
        while not job.finished.wait(POLL_S):
            if handle.is_cancel_requested or not rclpy.ok(context=self.context):
                job.cancel()
            for step in job.steps():
                status = convert.status_message(CalibrationStatus.RUNNING, self._header(), step)
                self._say(status)
                feedback = Calibrate.Feedback(iteration=status.iteration, gap_m=status.gap_m, stage=status.stage)
                feedback.sparsity, feedback.share_done = status.sparsity, status.share_done
                feedback.seconds_left = status.seconds_left
                handle.publish_feedback(feedback)

    def _publish(self, path: Path, message: str) -> Calibrate.Result:
        """The result as topics and as the action's answer. Raises ConfigError when it cannot be read."""
        result = read_result(path)
        header = self._header("table")
        self._parameters_topic.publish(convert.parameters_message(result, header, str(path)))
        self._graph_topic.publish(convert.graph_message(result, header))
        self._mismatch_topic.publish(convert.mismatch_message(result, header))
        return Calibrate.Result(
            success=True,
            message=message,
            result_json=str(path),
            gap_nominal=convert.mean_gap(result, "nominal"),
            gap_calibrated=convert.mean_gap(result, "calibrated"),
            verdict=result["mismatch"]["verdict"],
            sentence=result["mismatch"]["sentence"],
        )

    def _without_result(self, message: str) -> Calibrate.Result:
        return Calibrate.Result(success=False, message=message, gap_nominal=math.nan, gap_calibrated=math.nan)

    def _say(self, status: CalibrationStatus) -> None:
        self._status = status
        self._status_topic.publish(status)

    def _diagnose(self) -> None:
        self._diagnostics_topic.publish(convert.status_diagnostics(self._status, self.get_name(), self._header()))

    def _on_episode(self, info: EpisodeInfo) -> None:
        """A finished episode of our cell joins what the next calibration without named bags reads."""
        ours = info.cell == Path(self.get_parameter("cell").value).stem
        if info.state == EpisodeInfo.FINISHED and ours and info.bag not in self._recorded:
            self._recorded.append(info.bag)

    def _on_start(self) -> None:
        """Once, as soon as our own action server is there."""
        if not self._own_client.server_is_ready():
            return
        self._start_timer.cancel()
        if self.get_parameter("autostart").value and self.get_parameter("bags").value:
            self._own_client.send_goal_async(Calibrate.Goal())

    def _on_recalibrate(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        try:
            self._refuse_a_second()
            request = self._request(Calibrate.Goal())
        except CompassError as error:
            response.message = str(error)
            return response
        self._own_client.send_goal_async(Calibrate.Goal())
        response.success, response.message = True, f"calibrating from {len(request.bags)} bags"
        return response


def main() -> None:
    rclpy.init()
    node = Calibrator()
    executor = MultiThreadedExecutor(num_threads=4)
    executor.add_node(node)
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        executor.shutdown()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()

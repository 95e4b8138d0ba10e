"""Node `calibrator`: simulator parameters, causal graph and mismatch from recorded bags, as an action and as topics.

What it finds is a proposal. A person applies it (`~/apply`) or takes it back (`~/revert`); `operator.py` has that side.
"""

from __future__ import annotations

import math
import threading
import time

from compass_ros_interfaces.action import Calibrate
from compass_ros_interfaces.msg import CalibrationStatus, EpisodeInfo
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.action import ActionClient, ActionServer, CancelResponse, GoalResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.callback_groups import ReentrantCallbackGroup
from std_msgs.msg import Header
from std_srvs.srv import Trigger

from compass_ros.cells import load
from compass_ros.errors import CompassError, ConfigError
from compass_ros.nodes import convert
from compass_ros.nodes.calibrator_parameters import bags_of, declare_calibrator, output_of, request_of
from compass_ros.nodes.findings import Findings, answer
from compass_ros.nodes.job import Job, Outcome, Request, Step
from compass_ros.nodes.journal import cut_off
from compass_ros.nodes.managed import ManagedNode
from compass_ros.nodes.operator import Operator
from compass_ros.nodes.qos import LATCHED
from compass_ros.nodes.requests import one_line
from compass_ros.nodes.run import run
from compass_ros.operation.current import current
from compass_ros.operation.desk import Desk

POLL_S = 0.05
"""[s] How often a running calibration is looked at: delay of its progress and of a cancel."""
THREADS = 4
END_S = 5.0
"""[s] How long the end of a calibration may take when the node is told to end."""


class Calibrator(ManagedNode):
    """Every calibration is a goal of the action `~/calibrate`, also those that the service or the start asks for.

    A goal that is accepted runs already: what cannot start is refused, with the reason in the log and in `~/status`.
    """

    def __init__(self) -> None:
        super().__init__("calibrator")
        self._recorded: list[str] = []
        self._running: Job | None = None
        self._own_goal: Calibrate.Goal | None = None
        self._operator: Operator | None = None
        self._claim = threading.Lock()
        self._status = CalibrationStatus()
        declare_calibrator(self)

    def configure(self) -> None:
        """Raises ConfigError for a cell that cannot be loaded."""
        cell = load(self.get_parameter("cell").value)
        false_alarm = self.get_parameter("false_alarm").value
        desk = Desk(cell, self.place("versions"), output_of(self), false_alarm)
        self._cell_name, self._unit = cell.name, current(cell, threads=1).simulator.unit
        frame = convert.frame_of(cell, self.get_parameter("frame").value)
        self._findings = Findings(self, frame)
        self._status_topic = self.create_publisher(CalibrationStatus, "~/status", LATCHED)
        self._diagnostics_topic = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self._operator = Operator(self, desk, self.get_parameter("running_check").value, self._unit, frame)
        self._tell(CalibrationStatus.IDLE)

        self.create_subscription(EpisodeInfo, "recorder/status", self._on_episode, 100)
        self._action_server = ActionServer(
            self,
            Calibrate,
            "~/calibrate",
            self._execute,
            goal_callback=self._on_goal,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
            callback_group=ReentrantCallbackGroup(),
        )
        self._own_client = ActionClient(self, Calibrate, "~/calibrate")
        self.create_service(Trigger, "~/recalibrate", self._on_recalibrate)
        self.every(1.0, self._diagnose)

    def activate(self) -> None:
        """Raises ConfigError where the versions on disk are damaged."""
        self._the_operator.begin()
        self._show_earlier()
        self._first_goal = self._take_up()
        if self._first_goal is not None:
            self._start_timer = self.every(0.1, self._on_start)

    def deactivate(self) -> None:
        """A calibration that runs is ended."""
        self._end_job()

    def cleanup(self) -> None:
        self._end_job()
        if self._operator is not None:
            self._operator.close()
            self._own_client.destroy()
            self._action_server.destroy()
        self._operator = None

    def problems(self) -> list[str]:
        said = super().problems()
        if self.active and not bags_of(self) and not self.count_publishers("recorder/status"):
            said.append(f"nobody publishes {self.resolve_topic_name('recorder/status')}: new episodes are not heard of")
        return said

    def tell(self) -> None:
        if self._operator is not None:
            self._show(self._status)

    @property
    def _the_operator(self) -> Operator:
        if self._operator is None:
            raise ConfigError("the calibrator is not configured")
        return self._operator

    def _show_earlier(self) -> None:
        """A result that lies in the output is a proposal, also for those who look after a restart."""
        if not (output_of(self) / "result.json").is_file():
            return
        try:
            self._findings.publish(output_of(self) / "result.json")
            self._the_operator.propose(output_of(self))
        except ConfigError as error:
            self.get_logger().warning(one_line(str(error)))

    def _take_up(self) -> Calibrate.Goal | None:
        """What to begin with: a calibration that was cut off, or the bags that are named."""
        lost = cut_off(output_of(self))
        if lost is not None:
            anew = bool(self.get_parameter("resume").value)
            message = one_line(f"{lost}; {'it begins anew' if anew else 'it is not resumed'}")
            self.get_logger().warning(message)
            self._tell(CalibrationStatus.IDLE, message=message)
            if anew:
                return Calibrate.Goal(
                    bags=list(lost.bags), cell=lost.cell, seed=lost.seed, rollouts=lost.rollouts, output=lost.output
                )
        if self.get_parameter("calibrate_at_start").value and bags_of(self):
            return Calibrate.Goal()
        return None

    def _header(self) -> Header:
        return Header(stamp=self.get_clock().now().to_msg())

    def _begin(self, goal: Calibrate.Goal) -> Request:
        """Start the process of a calibration. Raises CompassError where another one runs, or this one cannot start."""
        with self._claim:
            if self._running is not None:
                raise CompassError(f"a calibration is already running ({self._status.share_done:.0%} done)")
            if not self.active:
                raise CompassError(f"the calibrator is {self.state}; activate it first")
            request = request_of(self, goal, self._recorded)
            self._running = Job.start(request)
            self._tell(CalibrationStatus.RUNNING)
            return request

    def _begin_own(self, goal: Calibrate.Goal) -> Request:
        """Start a calibration that this node asks itself for; its goal follows. Raises CompassError."""
        request = self._begin(goal)
        self._own_goal = goal
        self._own_client.send_goal_async(goal)
        return request

    def _on_goal(self, goal: Calibrate.Goal) -> GoalResponse:
        """Accept what runs."""
        with self._claim:
            if self._own_goal is not None and self._own_goal == goal:
                self._own_goal = None
                return GoalResponse.ACCEPT
        try:
            self._begin(goal)
        except CompassError as error:
            self._refuse(error)
            return GoalResponse.REJECT
        return GoalResponse.ACCEPT

    def _refuse(self, error: CompassError) -> str:
        """Say why nothing begins; the status goes on to tell of a calibration that runs."""
        message = one_line(f"refused: {error}")
        self.get_logger().error(message)
        self._status.message = message
        if self._running is None:
            self._status.state = CalibrationStatus.FAILED
        self._show(self._status)
        return message

    def _execute(self, handle: ServerGoalHandle) -> Calibrate.Result:
        job = self._running
        if job is None:
            raise RuntimeError("a goal was accepted, and nothing runs")
        try:
            self._follow(job, handle)
            return self._end(handle, job)
        except CompassError as error:
            return self._fail(handle, str(error))
        finally:
            self._running = None

    def _end(self, handle: ServerGoalHandle, job: Job) -> Calibrate.Result:
        """Say how a job has ended. Raises ConfigError when its result cannot be read."""
        if job.outcome is Outcome.FAILED:
            return self._fail(handle, job.message)
        if job.outcome is Outcome.CANCELLED:
            self._tell(CalibrationStatus.CANCELLED, message=job.message)
            if handle.is_cancel_requested:
                handle.canceled()
            else:  # the node ends, or is deactivated
                handle.abort()
            return _without_result(job.message)
        path = job.output / "result.json"
        result = self._findings.publish(path)
        self._the_operator.propose(job.output)
        self._tell(CalibrationStatus.SUCCEEDED, message=job.message, left_out=convert.left_out(result))
        handle.publish_feedback(convert.feedback_message(self._status))
        handle.succeed()
        return answer(result, path, job.message)

    def _fail(self, handle: ServerGoalHandle, message: str) -> Calibrate.Result:
        self.get_logger().error(message)
        self._tell(CalibrationStatus.FAILED, message=message)
        handle.abort()
        return _without_result(message)

    def _follow(self, job: Job, handle: ServerGoalHandle) -> None:
        """Hand on progress until the job has ended; a cancel, or the end of the node, ends it."""
        ended = False
        while not ended:
            ended = job.finished.wait(POLL_S)
            if handle.is_cancel_requested:
                job.cancel()
            for step in job.steps():
                self._tell(CalibrationStatus.RUNNING, step)
                handle.publish_feedback(convert.feedback_message(self._status))

    def _tell(self, state: int, step: Step | None = None, message: str = "", left_out: list[str] | None = None) -> None:
        self._show(convert.status_message(state, self._unit, step, message, left_out or []))

    def _show(self, status: CalibrationStatus) -> None:
        status.header, status.problems = self._header(), self.problems()
        self._status = status
        self._status_topic.publish(status)

    def _diagnose(self) -> None:
        name = self.get_fully_qualified_name()
        array = convert.status_diagnostics(self._status, name, self._header())
        array.status.append(self._the_operator.health(name))
        self._diagnostics_topic.publish(array)

    def _on_episode(self, info: EpisodeInfo) -> None:
        """A finished episode of our cell is checked, and joins what the next calibration without named bags reads.

        One that is discarded afterwards leaves both again.
        """
        if not self.active or info.cell != self._cell_name:
            return
        if info.state == EpisodeInfo.FINISHED and info.bag not in self._recorded:
            self._recorded.append(info.bag)
            self._the_operator.take(info.bag)
        elif info.state == EpisodeInfo.DISCARDED and info.bag in self._recorded:
            self._recorded.remove(info.bag)
            self._the_operator.drop(info.bag)

    def _on_start(self) -> None:
        """Once, as soon as our own action server is there."""
        if not self._own_client.server_is_ready():
            return
        self._start_timer.cancel()
        try:
            self._begin_own(self._first_goal)
        except CompassError as error:
            self._refuse(error)

    def _end_job(self) -> None:
        """End a running calibration and wait until nothing of it is left."""
        job = self._running
        if job is None:
            return
        job.cancel()
        job.finished.wait(END_S)
        deadline = time.monotonic() + END_S
        while self._running is not None and time.monotonic() < deadline:
            time.sleep(POLL_S)

    def _on_recalibrate(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        try:
            request = self._begin_own(Calibrate.Goal())
        except CompassError as error:
            response.message = self._refuse(error)
            return response
        response.success, response.message = True, f"calibrating from {len(request.bags)} bags, or folders of bags"
        return response


def _without_result(message: str) -> Calibrate.Result:
    return Calibrate.Result(success=False, message=message, gap_nominal=math.nan, gap_calibrated=math.nan)


def main() -> None:
    run(Calibrator, "calibrator", THREADS)


if __name__ == "__main__":
    main()

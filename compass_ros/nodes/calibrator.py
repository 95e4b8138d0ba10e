"""Node `calibrator`: simulator parameters, causal graph and mismatch from recorded bags, as an action and as topics.

What it finds is a proposal. A person applies it (`~/apply`) or takes it back (`~/revert`); `operator.py` has that side.
"""

from __future__ import annotations

import math
import threading
import time
from pathlib import Path

from compass_ros_interfaces.action import Calibrate
from compass_ros_interfaces.msg import CalibrationStatus, CausalGraph, EpisodeInfo, Mismatch, SimParameters
from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.msg import FloatingPointRange, IntegerRange
from rclpy.action import ActionClient, ActionServer, CancelResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.callback_groups import ReentrantCallbackGroup
from std_msgs.msg import Header
from std_srvs.srv import Trigger

from compass_ros.cells import load
from compass_ros.errors import CompassError, ConfigError, shown
from compass_ros.nodes import convert
from compass_ros.nodes.job import Job, Outcome, Request, Step
from compass_ros.nodes.journal import cut_off
from compass_ros.nodes.managed import ManagedNode
from compass_ros.nodes.operator import Operator
from compass_ros.nodes.qos import LATCHED
from compass_ros.nodes.requests import checked_output, checked_paths, one_line
from compass_ros.nodes.run import run
from compass_ros.operation.current import current
from compass_ros.operation.desk import Desk
from compass_ros.reporting.result_json import read_result

POLL_S = 0.05
"""[s] How often a running calibration is looked at: delay of its progress and of a cancel."""
THREADS = 4
END_S = 5.0
"""[s] How long the end of a calibration may take when the node is told to end."""


class BusyError(CompassError):
    """A calibration is running, and another one was asked for."""


class Calibrator(ManagedNode):
    """Every calibration is a goal of the action `~/calibrate`, also those that the service or the start asks for."""

    def __init__(self) -> None:
        super().__init__("calibrator")
        self._recorded: list[str] = []
        self._running: Job | None = None
        self._operator: Operator | None = None
        self._claim = threading.Lock()
        self._status = CalibrationStatus()
        self._declare()

    def _declare(self) -> None:
        natural = [IntegerRange(from_value=0, to_value=2**63 - 1, step=1)]
        declare = self.declare_described
        # One path is accepted where a list is expected, hence the dynamic type.
        paths = "paths of bags, or of folders that hold bags: one, or a list; empty: only what the recorder finishes"
        declare("bags", "", paths, dynamic_typing=True)
        declare("seed", 0, "seed of all random numbers", integer_range=natural)
        declare("rollouts", 0, "budget of simulated rollouts [count]; 0: the method's default", integer_range=natural)
        declare("method", "default", "as `compass calibrate --method`")
        newest = "of the episodes that the recorder finishes, only so many of the newest are read; of more than 100 "
        newest += "a calibration uses an even choice of 100"
        declare("newest", 100, newest, integer_range=[IntegerRange(from_value=1, to_value=10_000, step=1)])
        declare("calibrate_at_start", True, "calibrate when the node becomes active, if `bags` names any")
        declare("resume", True, "calibrate anew when the node was killed in a calibration; false: only say so")
        self.declare_fixed("cell", "air_hockey", "name of a cell, or path of its YAML")
        output = "folder of the result; an earlier result there is replaced when the new one is complete. Goals of the "
        output += "action may name other folders beside it, or deeper"
        self.declare_fixed("output", "out/calibration", output)
        versions = "folder of the versions of the parameters that a person has applied"
        self.declare_fixed("versions", "out/versions", versions)
        self.declare_fixed("running_check", True, "compare each new episode with the simulator in force")
        rate = "the running check: probability of ever asking for a calibration though nothing has changed"
        limits = [FloatingPointRange(from_value=1e-6, to_value=0.5)]
        self.declare_fixed("false_alarm", 0.01, rate, floating_point_range=limits)

    def configure(self) -> None:
        """Raises ConfigError for a cell that cannot be loaded."""
        cell = load(self.get_parameter("cell").value)
        versions, false_alarm = Path(self.get_parameter("versions").value), self.get_parameter("false_alarm").value
        desk = Desk(cell, versions, self._output(), false_alarm)
        self._cell_name, self._unit = cell.name, current(cell, threads=1).simulator.unit
        self._parameters_topic = self.create_publisher(SimParameters, "~/sim_parameters", LATCHED)
        self._graph_topic = self.create_publisher(CausalGraph, "~/causal_graph", LATCHED)
        self._mismatch_topic = self.create_publisher(Mismatch, "~/mismatch", LATCHED)
        self._status_topic = self.create_publisher(CalibrationStatus, "~/status", LATCHED)
        self._diagnostics_topic = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self._operator = Operator(self, desk, self.get_parameter("running_check").value)
        self._tell(CalibrationStatus.IDLE)

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

    def activate(self) -> None:
        """Raises ConfigError where the versions on disk are damaged."""
        self._the_operator.begin()
        self._show_earlier()
        self._first_goal = self._take_up()
        if self._first_goal is not None:
            self._start_timer = self.create_timer(0.1, self._on_start)

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

    @property
    def _the_operator(self) -> Operator:
        if self._operator is None:
            raise ConfigError("the calibrator is not configured")
        return self._operator

    def _output(self) -> Path:
        return Path(self.get_parameter("output").value)

    def _show_earlier(self) -> None:
        """A result that lies in the output is a proposal, also for those who look after a restart."""
        output = self._output().expanduser().absolute()
        if not (output / "result.json").is_file():
            return
        try:
            self._publish(output / "result.json", "")
            self._the_operator.propose(output)
        except ConfigError as error:
            self.get_logger().warning(one_line(str(error)))

    def _take_up(self) -> Calibrate.Goal | None:
        """What to begin with: a calibration that was cut off, or the bags that are named."""
        lost = cut_off(self._output().expanduser().absolute())
        if lost is not None:
            anew = bool(self.get_parameter("resume").value)
            message = one_line(f"{lost}; {'it begins anew' if anew else 'it is not resumed'}")
            self.get_logger().warning(message)
            self._tell(CalibrationStatus.IDLE, message=message)
            if anew:
                return Calibrate.Goal(
                    bags=list(lost.bags), cell=lost.cell, seed=lost.seed, rollouts=lost.rollouts, output=lost.output
                )
        if self.get_parameter("calibrate_at_start").value and self.get_parameter("bags").value:
            return Calibrate.Goal()
        return None

    def _header(self, frame: str = "") -> Header:
        return Header(stamp=self.get_clock().now().to_msg(), frame_id=frame)

    def _bags(self) -> tuple[str, ...]:
        value = self.get_parameter("bags").value
        bags = [value] if isinstance(value, str) else list(value or ())
        if not all(isinstance(bag, str) for bag in bags):
            raise ConfigError(f"bags: expected a path or a list of paths, found {shown(value)}")
        return tuple(bag for bag in bags if bag)

    def _request(self, goal: Calibrate.Goal) -> Request:
        """What the goal asks for; the node's parameters where it leaves a field empty."""
        checked_paths(goal)
        newest = self._recorded[-int(self.get_parameter("newest").value) :]
        bags = tuple(goal.bags) or (*self._bags(), *newest)
        if not bags:
            raise ConfigError("no bags: name them in the goal or in the parameter `bags`, or record episodes")
        return Request(
            bags=tuple(str(Path(bag).expanduser().absolute()) for bag in bags),
            cell=goal.cell or self.get_parameter("cell").value,
            seed=goal.seed or self.get_parameter("seed").value,
            rollouts=goal.rollouts or self.get_parameter("rollouts").value,
            output=checked_output(goal.output, self._output()),
            method=self.get_parameter("method").value,
        )

    def _begin(self, goal: Calibrate.Goal) -> Job:
        """Raises BusyError when a calibration is running, ConfigError when this one cannot start."""
        with self._claim:
            self._refuse_a_second()
            self._running = Job.start(self._request(goal))
            self._tell(CalibrationStatus.RUNNING)
            return self._running

    def _refuse_a_second(self) -> None:
        if self._running is not None:
            raise BusyError(f"refused: a calibration is already running ({self._status.share_done:.0%} done)")
        if not self.active:
            raise BusyError(f"refused: the calibrator is {self.state}; activate it first")

    def _execute(self, handle: ServerGoalHandle) -> Calibrate.Result:
        try:
            job = self._begin(handle.request)
        except BusyError as error:  # the running one keeps the status
            handle.abort()
            return self._without_result(str(error))
        except CompassError as error:
            return self._fail(handle, one_line(str(error)))
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
            return self._without_result(job.message)
        answer = self._publish(job.output / "result.json", job.message)
        self._the_operator.propose(job.output)
        self._tell(CalibrationStatus.SUCCEEDED, message=job.message)
        handle.succeed()
        return answer

    def _fail(self, handle: ServerGoalHandle, message: str) -> Calibrate.Result:
        self.get_logger().error(message)
        self._tell(CalibrationStatus.FAILED, message=message)
        handle.abort()
        return self._without_result(message)

    def _follow(self, job: Job, handle: ServerGoalHandle) -> None:
        """Hand on progress until the job has ended; a cancel, or the end of the node, ends it."""
        while not job.finished.wait(POLL_S):
            if handle.is_cancel_requested:
                job.cancel()
            for step in job.steps():
                status = self._tell(CalibrationStatus.RUNNING, step)
                feedback = Calibrate.Feedback(iteration=status.iteration, stage=status.stage)
                feedback.gap, feedback.unit = status.gap, status.unit
                feedback.sparsity, feedback.share_done = status.sparsity, status.share_done
                feedback.seconds_left = status.seconds_left
                handle.publish_feedback(feedback)

    def _publish(self, path: Path, message: str) -> Calibrate.Result:
        """The result as topics and as the action's answer. Raises ConfigError when it cannot be read."""
        result = read_result(path)
        for warning in result["warnings"]:
            self.get_logger().warning(one_line(warning))
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
            unit=convert.unit(result),
            verdict=result["mismatch"]["verdict"],
            sentence=result["mismatch"]["sentence"],
        )

    def _without_result(self, message: str) -> Calibrate.Result:
        return Calibrate.Result(success=False, message=message, gap_nominal=math.nan, gap_calibrated=math.nan)

    def _tell(self, state: int, step: Step | None = None, message: str = "") -> CalibrationStatus:
        self._status = convert.status_message(state, self._header(), self._unit, step, message)
        self._status_topic.publish(self._status)
        return self._status

    def _diagnose(self) -> None:
        array = convert.status_diagnostics(self._status, self.get_name(), self._header())
        array.status.append(self._the_operator.health(self.get_name()))
        self._diagnostics_topic.publish(array)

    def _on_episode(self, info: EpisodeInfo) -> None:
        """A finished episode of our cell is checked, and joins what the next calibration without named bags reads."""
        ours = info.cell == self._cell_name
        if self.active and info.state == EpisodeInfo.FINISHED and ours and info.bag not in self._recorded:
            self._recorded.append(info.bag)
            self._the_operator.take(info.bag)

    def _on_start(self) -> None:
        """Once, as soon as our own action server is there."""
        if not self._own_client.server_is_ready():
            return
        self._start_timer.cancel()
        self._own_client.send_goal_async(self._first_goal)

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
            self._refuse_a_second()
            request = self._request(Calibrate.Goal())
        except CompassError as error:
            response.message = str(error)
            return response
        self._own_client.send_goal_async(Calibrate.Goal())
        response.success, response.message = True, f"calibrating from {len(request.bags)} bags"
        return response


def main() -> None:
    run(Calibrator, "calibrator", THREADS)


if __name__ == "__main__":
    main()

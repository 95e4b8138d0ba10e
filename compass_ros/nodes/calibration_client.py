"""Node `calibration_client`: asks a calibrator for one calibration and prints how it goes on.

One JSON object a line on standard output: the action's feedback while it runs, its result at the end. Status 1 where
the calibration fails. Ending the client cancels the calibration.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Mapping
from typing import Any

import rclpy
from compass_ros_interfaces.action import Calibrate
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.action import ActionClient
from rclpy.action.client import ClientGoalHandle
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.task import Future

FIELDS = ("stage", "iteration", "share_done", "gap", "unit", "sparsity", "seconds_left")


class CalibrationClient(Node):
    """One goal."""

    def __init__(self) -> None:
        super().__init__("calibration_client")

        def declare(name: str, default: object, text: str) -> Any:
            return self.declare_parameter(name, default, ParameterDescriptor(description=text, read_only=True)).value

        self._timeout_s = declare("timeout_s", 30.0, "a calibrator that takes longer to answer is not there [s]")
        self._goal = Calibrate.Goal(
            bags=[bag for bag in declare("bags", [""], "bags, or folders of bags; empty: the calibrator's own") if bag],
            cell=declare("cell", "", "name of a cell, or path of its YAML; empty: the calibrator's own"),
            seed=declare("seed", 0, "seed of all random numbers"),
            rollouts=declare("rollouts", 0, "budget of simulated rollouts; 0: the method's default"),
            output=declare("output", "", "folder of the result; empty: the calibrator's own"),
        )
        self._action = ActionClient(self, Calibrate, "calibrator/calibrate")

    def run(self) -> str:
        """Send the goal and wait for its end; a sentence about what went wrong, or nothing."""
        if not self._action.wait_for_server(self._timeout_s):
            return f"waited {self._timeout_s:g} s for a calibrator"
        sent = self._action.send_goal_async(self._goal, feedback_callback=_on_feedback)
        rclpy.spin_until_future_complete(self, sent)
        handle: ClientGoalHandle = sent.result()
        if not handle.accepted:
            return "the calibrator does not take the goal"
        answer: Future = handle.get_result_async()
        try:
            rclpy.spin_until_future_complete(self, answer)
        except KeyboardInterrupt:
            rclpy.spin_until_future_complete(self, handle.cancel_goal_async(), timeout_sec=2.0)
            raise
        result = answer.result().result
        names = ("success", "message", "result_json", "gap_nominal", "gap_calibrated", "unit", "verdict", "sentence")
        say({name: getattr(result, name) for name in names})
        return "" if result.success else str(result.message)


def _on_feedback(message: Any) -> None:
    say({name: getattr(message.feedback, name) for name in FIELDS})


def say(content: Mapping[str, object]) -> None:
    """One line for the program that watches; JSON has no NaN."""

    def finite(value: object) -> object:
        return None if isinstance(value, float) and not math.isfinite(value) else value

    print(json.dumps({name: finite(value) for name, value in content.items()}), flush=True)


def main() -> None:
    # The signal is Python's own, so that the client is still connected when it cancels.
    rclpy.init(signal_handler_options=rclpy.signals.SignalHandlerOptions.NO)
    try:
        error = CalibrationClient().run()
        if error:
            sys.exit(f"calibration_client: {error}")
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()

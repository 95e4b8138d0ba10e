"""Node `calibration_client`: asks a calibrator for one calibration and prints how it goes on.

One JSON object a line on standard output: the action's feedback while it runs, its result at the end. Status 1 where
the calibration fails. Ending the client cancels the calibration.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Mapping
from contextlib import suppress
from typing import Any

import rclpy
from compass_ros_interfaces.action import Calibrate
from compass_ros_interfaces.msg import CalibrationStatus
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.action import ActionClient
from rclpy.action.client import ClientGoalHandle
from rclpy.node import Node
from rclpy.task import Future

from compass_ros.errors import CompassError
from compass_ros.nodes.qos import LATCHED
from compass_ros.nodes.run import connected

REASON_S = 2.0
"""[s] How long the reason of a refusal may take after it."""
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
        self._said = ""
        self.create_subscription(CalibrationStatus, "calibrator/status", self._on_status, LATCHED)

    def run(self) -> str:
        """Send the goal and wait for its end; a sentence about what went wrong, or nothing."""
        if not self._action.wait_for_server(self._timeout_s):
            return f"waited {self._timeout_s:g} s for a calibrator"
        sent = self._action.send_goal_async(self._goal, feedback_callback=_on_feedback)
        rclpy.spin_until_future_complete(self, sent)
        handle: ClientGoalHandle = sent.result()
        if not handle.accepted:
            return self._refusal()
        answer: Future = handle.get_result_async()
        try:
            rclpy.spin_until_future_complete(self, answer)
        except KeyboardInterrupt:
            rclpy.spin_until_future_complete(self, handle.cancel_goal_async(), timeout_sec=2.0)
            raise
        result = answer.result().result
        names = (
            "success",
            "message",
            "result_json",
            "gap_nominal",
            "gap_calibrated",
            "unit",
            "verdict",
            "sentence",
            "left_out",
        )
        say({name: getattr(result, name) for name in names})
        return "" if result.success else str(result.message)

    def _on_status(self, status: CalibrationStatus) -> None:
        self._said = status.message

    def _refusal(self) -> str:
        """Why the goal was not taken: the status says so, at about the time of the answer."""
        deadline = time.monotonic() + REASON_S
        while not self._said.startswith("refused") and time.monotonic() < deadline:
            rclpy.spin_once(self, timeout_sec=0.05)
        return self._said or "the calibrator does not take the goal, and does not say why"


def _on_feedback(message: Any) -> None:
    say({name: getattr(message.feedback, name) for name in FIELDS})


def say(content: Mapping[str, object]) -> None:
    """One line for the program that watches; JSON has no NaN."""

    def finite(value: object) -> object:
        return None if isinstance(value, float) and not math.isfinite(value) else value

    print(json.dumps({name: finite(value) for name, value in content.items()}), flush=True)


def main() -> None:
    # A signal is Python's own, so that the client is still connected when it cancels.
    with connected("calibration_client"), suppress(KeyboardInterrupt):
        error = CalibrationClient().run()
        if error:
            raise CompassError(error)


if __name__ == "__main__":
    main()

"""Node `shooter`: plays a list of shots, each recorded as an episode of its own; stands where the operator stands.

For each shot it starts an episode, gives the command, waits until the tracker has followed the whole of it, and stops
the episode. It prints one JSON object a line about each shot on standard output, and at the end, where it is asked to
and the cell can tell, its true parameters and physics. It ends when all is played; status 1 where something does not
answer.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import rclpy
from compass_ros_interfaces.msg import ShotCommand
from compass_ros_interfaces.srv import StartEpisode, StopEpisode
from geometry_msgs.msg import PoseWithCovarianceStamped
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor
from rclpy.client import Client
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from std_srvs.srv import Trigger

from compass_ros.cells import load
from compass_ros.config import read_yaml
from compass_ros.errors import CompassError, ConfigError, shown
from compass_ros.nodes.images import stamp_ns
from compass_ros.nodes.run import connected


class SilenceError(CompassError):
    """Something that has to answer does not."""


class Shooter(Node):
    """Everything that a shot needs: the cell's command, the tracker's poses, the recorder's services."""

    def __init__(self) -> None:
        super().__init__("shooter")
        self._declare()
        self._cell = load(self.get_parameter("cell").value)
        self._shots = read_shots(Path(self.get_parameter("shots_file").value))
        self._timeout_s = float(self.get_parameter("timeout_s").value)
        self._begun: list[ShotCommand] = []
        self._newest_ns = 0

        self._command = self.create_publisher(ShotCommand, "virtual_cell/command", 10)
        self.create_subscription(ShotCommand, "virtual_cell/shot", self._begun.append, 10)
        for one in self._cell.objects:
            topic = one.topic.lstrip("/") or f"puck_tracker/{one.name}/pose"  # a cell says it from the root
            self.create_subscription(PoseWithCovarianceStamped, topic, self._on_pose, qos_profile_sensor_data)
        self._start = self.create_client(StartEpisode, "recorder/start_episode")
        self._stop = self.create_client(StopEpisode, "recorder/stop_episode")
        self._discard = self.create_client(Trigger, "recorder/discard_episode")
        self._reveal = self.create_client(Trigger, "virtual_cell/reveal")

    def _declare(self) -> None:
        def declare(name: str, default: object, text: str, **ranges: object) -> None:
            described = ParameterDescriptor(description=text, read_only=True, **ranges)
            self.declare_parameter(name, default, described)

        seconds = {"floating_point_range": [FloatingPointRange(from_value=0.0, to_value=86_400.0)]}
        declare("cell", "air_hockey", "name of the cell, or path of its YAML")
        declare("shots_file", "", "YAML with the list `shots`, each a mapping from fields of the action to values")
        pause = "from the end of a shot to the next, while all is put back, in the sensor's time [s]"
        declare("pause_s", 0.8, pause, **seconds)
        declare("timeout_s", 60.0, "an answer that takes longer will not come [s]", **seconds)
        declare("reveal", False, "ask the virtual cell for its true parameters and physics when all is played")

    def _on_pose(self, pose: PoseWithCovarianceStamped) -> None:
        self._newest_ns = max(self._newest_ns, stamp_ns(pose.header.stamp))

    def run(self) -> None:
        """Play all shots. Raises SilenceError."""
        self._until(lambda: self._newest_ns > 0, "poses from the tracker")
        self._until(lambda: self._command.get_subscription_count() > 0, "a cell that takes commands")
        for number, shot in enumerate(self._shots, 1):
            info = self._record(shot)
            say(shot=number, of=len(self._shots), episode=info.episode, bag=info.bag, messages=info.messages)
        if self.get_parameter("reveal").value:
            say(truth=json.loads(self._call(self._reveal, Trigger.Request()).message))

    def _record(self, shot: Mapping[str, float]) -> Any:
        """One episode; its EpisodeInfo. A shot that is not seen to its end leaves no bag."""
        self._call(self._start, StartEpisode.Request(cell=self._cell.name, cell_hash=self._cell.hash))
        try:
            self._begun.clear()
            self._command.publish(ShotCommand(cell=self._cell.name, names=list(shot), values=list(shot.values())))
            self._until(lambda: bool(self._begun), "the beginning of the shot")
            end_ns = stamp_ns(self._begun[0].header.stamp) + round(self._cell.duration * 1e9)
            self._until(lambda: self._newest_ns >= end_ns, "poses of the whole shot")
        except (SilenceError, KeyboardInterrupt):
            self._call(self._discard, Trigger.Request())
            raise
        info = self._call(self._stop, StopEpisode.Request()).info
        ready_ns = end_ns + round(self.get_parameter("pause_s").value * 1e9)
        self._until(lambda: self._newest_ns >= ready_ns, "poses after the shot")
        return info

    def _call(self, client: Client, request: Any) -> Any:
        """The response of a service. Raises SilenceError where there is none, or where it refuses."""
        name = client.srv_name
        self._until(client.service_is_ready, f"the service {name}")
        future = client.call_async(request)
        self._until(future.done, f"an answer of {name}")
        response = future.result()
        if not response.success:
            raise SilenceError(f"{name}: {response.message}")
        return response

    def _until(self, condition: Callable[[], bool], what: str) -> None:
        deadline = time.monotonic() + self._timeout_s
        while not condition():
            if time.monotonic() > deadline:
                raise SilenceError(f"waited {self._timeout_s:g} s for {what}")
            rclpy.spin_once(self, timeout_sec=0.05)


def read_shots(path: Path) -> list[dict[str, float]]:
    """Shots of a YAML. Raises ConfigError with one line."""
    shots = read_yaml(path).get("shots")
    if not isinstance(shots, list) or not shots:
        raise ConfigError(f"{path}: expected a list 'shots', found {shown(shots)}")
    for number, shot in enumerate(shots, 1):
        if not isinstance(shot, dict) or not all(isinstance(value, (int, float)) for value in shot.values()):
            raise ConfigError(f"{path}: shot {number}: expected numbers by name, found {shown(shot)}")
    return [{str(name): float(value) for name, value in shot.items()} for shot in shots]


def say(**content: object) -> None:
    """One line for the program that watches."""
    print(json.dumps(content), flush=True)


def main() -> None:
    with connected("shooter"), suppress(KeyboardInterrupt):
        Shooter().run()


if __name__ == "__main__":
    main()

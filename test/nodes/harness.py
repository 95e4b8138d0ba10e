"""Nodes as separate processes, and a client that talks to them over DDS like any other participant."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import yaml
from rclpy.action import ActionClient
from rclpy.client import Client
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy, qos_profile_sensor_data
from rclpy.task import Future

from compass_ros.demo.shared_memory import kill

Message = TypeVar("Message")

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL, reliability=ReliabilityPolicy.RELIABLE)
RELIABLE = QoSProfile(depth=100)
SENSOR = qos_profile_sensor_data
PATIENCE_S = 180.0
"""How long a test waits for what must come. A machine may be slow; where all is well, nobody waits."""

SETTLE_S = 1.0
"""How long a new client waits before it asks: a server drops its answer to one that it has not discovered in 0.1 s.
With two cores taken by five other processes 0.3 s were too short once in some hundred calls."""


def until(condition: Callable[[], bool], what: str, timeout_s: float = PATIENCE_S) -> None:
    """Wait for a condition; fail with a sentence."""
    deadline = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < deadline, f"waited {timeout_s} s for {what}"
        time.sleep(0.01)


class NodeProcess:
    """A node of the suite in a process of its own."""

    def __init__(self, name: str, folder: Path, parameters: Mapping[str, Any], arguments: tuple[str, ...]) -> None:
        """`name`: module in compass_ros.nodes; `parameters`: as in a parameter file; `arguments`: after --ros-args."""
        self.name = name
        self._log = folder / f"{name}.log"
        file = folder / f"{name}.yaml"
        file.write_text(yaml.safe_dump({"/**": {"ros__parameters": dict(parameters)}}))
        words = [sys.executable, "-m", f"compass_ros.nodes.{name}", "--ros-args"]
        words += ["--params-file", str(file)] if parameters else []
        with self._log.open("wb") as log:
            self.process = subprocess.Popen(
                [*words, *arguments], stdout=log, stderr=subprocess.STDOUT, cwd=folder, start_new_session=True
            )

    def output(self) -> str:
        """All that it printed and logged."""
        return self._log.read_text(errors="replace")

    def stop(self, by: signal.Signals = signal.SIGINT) -> int:
        """Ask it to end, as Ctrl-C does; its exit status."""
        self.process.send_signal(by)
        return self.process.wait(PATIENCE_S)

    def kill(self) -> None:
        """End it at once, with all that it started in its group, and remove the shared memory that was its own."""
        if self.process.poll() is None:
            kill(self.process, PATIENCE_S)


class Probe:
    """A node of the test's own, spun by a thread; what it hears is kept."""

    def __init__(self, domain: int) -> None:
        self._context = Context()
        self._context.init(domain_id=domain)
        self.node = Node("probe", context=self._context, enable_rosout=False, start_parameter_services=False)
        self._clients: dict[str, Client] = {}
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self._closed = Future()
        self._thread = threading.Thread(
            target=self._executor.spin_until_future_complete, args=(self._closed,), name="probe"
        )
        self._thread.start()

    def close(self) -> None:
        """Stop spinning, then end the context: a thread that spins can meet one that is gone."""
        self._closed.set_result(None)
        self._thread.join()
        self._executor.shutdown()
        self.node.destroy_node()
        self._context.try_shutdown()

    def listen(
        self, kind: type[Message], topic: str, qos: QoSProfile = RELIABLE, connect: bool = True
    ) -> list[Message]:
        """A list that grows with every message; returns once a publisher is there, unless `connect` is False."""
        heard: list[Message] = []
        self.node.create_subscription(kind, topic, heard.append, qos)
        if connect:
            until(lambda: self.node.count_publishers(topic) > 0, f"a publisher of {topic}")
        return heard

    def wait_for(self, heard: list[Message], where: Callable[[Message], bool] = lambda _: True) -> Message:
        """The first message in a list of `listen` that fulfils `where`, now or later."""
        until(lambda: any(where(message) for message in heard), f"a message; heard {heard[-3:]}")
        return next(message for message in heard if where(message))

    def publisher(self, kind: type[Message], topic: str, qos: QoSProfile = RELIABLE) -> Callable[[Message], None]:
        """A function that publishes; returns once a subscriber is there."""
        publisher = self.node.create_publisher(kind, topic, qos)
        until(lambda: publisher.get_subscription_count() > 0, f"a subscriber of {topic}")
        publish: Callable[[Message], None] = publisher.publish
        return publish

    def call(self, kind: Any, service: str, request: Any = None) -> Any:
        """The response of a service."""
        client = self._clients.get(service)
        if client is None or not client.service_is_ready():
            client = self._clients[service] = client or self.node.create_client(kind, service)
            assert client.wait_for_service(PATIENCE_S), f"no service {service}"
            time.sleep(SETTLE_S)
        return self.result(client.call_async(request or kind.Request()))

    def action(self, kind: Any, name: str) -> ActionClient:
        """A client of an action; returns once the server is there."""
        client = ActionClient(self.node, kind, name)
        assert client.wait_for_server(PATIENCE_S), f"no action {name}"
        return client

    def ask(self, request: Callable[..., Future], *words: Any) -> Any:
        """The answer to a request of an action's client, made by the thread that spins.

        From another thread, an answer can arrive before rclpy has noted the request, which it then drops.
        """
        asked = self._executor.create_task(request, *words)
        return self.result(self.result(asked))

    def result(self, future: Future) -> Any:
        """What a future holds, once it does."""
        until(future.done, "an answer")
        return future.result()

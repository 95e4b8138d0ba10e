"""Nodes as processes, in a DDS domain of their own. Neither they nor their shared memory outlive the group."""

from __future__ import annotations

import json
import os
import select
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

import yaml
from domain_coordinator import domain_id

from compass_ros.demo.shared_memory import kill, remove_half_made_ports, remove_ports
from compass_ros.errors import CompassError, ConfigError

CHECK_S = 0.5
"""[s] How soon the end of a node is noticed."""


class NodeError(CompassError):
    """A node process has ended before its work was done, or does not answer."""


class NodeProcess:
    """One node of the suite. It leads a session of its own: the terminal's Ctrl-C does not reach it."""

    def __init__(
        self, name: str, logs: Path, environment: Mapping[str, str], parameters: Mapping[str, object], pipe: bool
    ) -> None:
        """`name`: module in compass_ros.nodes; with `pipe` its standard output can be read, else it goes to the log."""
        self.name = name
        self.log = logs / f"{name}.log"
        file = logs / f"{name}.yaml"
        file.write_text(yaml.safe_dump({"/**": {"ros__parameters": dict(parameters)}}), encoding="utf-8")
        words = [sys.executable, "-m", f"compass_ros.nodes.{name}", "--ros-args", "--params-file", str(file)]
        with self.log.open("wb") as log:
            self.process = subprocess.Popen(
                words,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE if pipe else log,
                stderr=log,
                env=dict(environment),
                start_new_session=True,
            )

    def check(self) -> None:
        """Raises NodeError if it has ended."""
        status = self.process.poll()
        if status is not None:
            said = self.last_words().removeprefix(f"{self.name}: ")
            raise NodeError(f"node {self.name} ended with status {status}: {said} (log: {self.log})")

    def last_words(self) -> str:
        """Last line of its log."""
        lines = self.log.read_text(encoding="utf-8", errors="replace").strip().splitlines()
        return lines[-1] if lines else "it said nothing"

    def ask_to_end(self) -> None:
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)

    def end(self, deadline: float) -> None:
        """Wait until it has ended; at the deadline (time.monotonic) end it with its children, and tidy up after it."""
        try:
            self.process.wait(max(deadline - time.monotonic(), 0.01))
        except subprocess.TimeoutExpired:
            kill(self.process)
        if self.process.stdout is not None:
            self.process.stdout.close()


class NodeGroup:
    """A context in which nodes can be started; they share a domain that nobody else on this machine uses."""

    def __init__(self, logs: Path, patience_s: float = 10.0) -> None:
        """`logs`: folder for what the nodes say; `patience_s`: how long a node may take to end [s]."""
        logs.mkdir(parents=True, exist_ok=True)
        self._logs = logs
        self._patience_s = patience_s
        self._coordinator = domain_id()
        self._domain = 0
        self._nodes: list[NodeProcess] = []

    def __enter__(self) -> NodeGroup:
        self._domain = self._coordinator.__enter__()
        remove_half_made_ports()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        impatient = signal.signal(signal.SIGINT, signal.SIG_IGN)  # a second Ctrl-C must not cut this short
        try:
            self.stop(*self._nodes)
            remove_ports(self._domain)
        finally:
            signal.signal(signal.SIGINT, impatient)
            self._coordinator.__exit__(kind, error, trace)

    def start(self, name: str, pipe: bool = False, **parameters: object) -> NodeProcess:
        """Start a node with ROS parameters."""
        node = NodeProcess(name, self._logs, self._environment(), parameters, pipe)
        self._nodes.append(node)
        return node

    def stop(self, *nodes: NodeProcess) -> None:
        """End nodes as Ctrl-C does, all at once."""
        for node in nodes:
            node.ask_to_end()
        deadline = time.monotonic() + self._patience_s
        for node in nodes:
            node.end(deadline)
            self._nodes = [other for other in self._nodes if other is not node]

    def follow(self, node: NodeProcess) -> Iterator[Mapping[str, Any]]:
        """The JSON objects that a node prints, one a line, until it ends by itself and well.

        Raises NodeError when it, or any other node of the group, ends otherwise.
        """
        others = [other for other in self._nodes if other is not node]
        for line in _lines(node, others):
            yield json.loads(line)
        if node.process.wait(self._patience_s):
            node.check()

    def _environment(self) -> dict[str, str]:
        return os.environ | {
            "ROS_DOMAIN_ID": str(self._domain),
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
            "RMW_IMPLEMENTATION": "rmw_fastrtps_cpp",
            "FASTRTPS_DEFAULT_PROFILES_FILE": str(shared_file("config/fastdds.xml")),
            "ROS_LOG_DIR": str(self._logs.absolute() / "ros"),
            "PYTHONUNBUFFERED": "1",
        }


def shared_file(name: str) -> Path:
    """A file of the suite that is no Python, in a checkout or under share/compass_ros of the prefix.

    Raises ConfigError where it is not installed.
    """
    places = [place for up in Path(__file__).parents for place in (up / name, up / "share" / "compass_ros" / name)]
    found = next((place for place in places if place.is_file()), None)
    if found is None:
        raise ConfigError(f"{name}: not installed with compass_ros; see docs/install.md")
    return found


def _lines(node: NodeProcess, others: Sequence[NodeProcess]) -> Iterator[bytes]:
    """Whole lines of a node's standard output, while all `others` run."""
    stream, rest = node.process.stdout, b""
    while stream is not None:
        for other in others:
            other.check()
        if not select.select([stream], [], [], CHECK_S)[0]:
            continue
        read = os.read(stream.fileno(), 65536)
        if not read:
            return
        *whole, rest = (rest + read).split(b"\n")
        yield from whole

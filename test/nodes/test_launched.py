"""What the launch files would start, started without ROS's launch: the same nodes, names, parameters and remappings."""

from __future__ import annotations

import json
import os
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseWithCovarianceStamped
from lifecycle_msgs.srv import GetState
from rosgraph_msgs.msg import Clock

from compass_ros.demo.shared_memory import held_locks
from compass_ros.episodes import list_topics
from test.nodes.harness import PATIENCE_S, RELIABLE, SENSOR, Probe, until
from test.test_launch import Noted, description

pytestmark = pytest.mark.ros
ROOT = Path(__file__).parents[2]


def resolved(value: Any, arguments: Mapping[str, Any]) -> str:
    """Text of a substitution."""
    if not isinstance(value, Noted):
        return str(value)
    if value.kind == "LaunchConfiguration":
        return resolved(arguments[value.args[0]], arguments)
    if value.kind == "FindPackageShare":
        return str(ROOT)
    return str(Path(*(resolved(part, arguments) for part in value.args[0])))


def commands(name: str, given: Mapping[str, str], monkeypatch: pytest.MonkeyPatch) -> dict[str, list[str]]:
    """Node -> the command line that ros2 launch would run; our own nodes only."""
    entities = description(name, monkeypatch)
    arguments: dict[str, Any] = {
        e.args[0]: e.words["default_value"] for e in entities if e.kind == "DeclareLaunchArgument"
    }
    arguments |= given
    lines = {}
    for node in (e.words for e in entities if e.kind == "Node" and e.words["package"] == "compass_ros"):
        words = shlex.split(resolved(node.get("prefix") or "", arguments))
        words += [sys.executable, "-m", f"compass_ros.nodes.{node['executable']}", "--ros-args"]
        words += ["-r", f"__node:={node['name']}", "-r", f"__ns:=/{resolved(node['namespace'], arguments)}"]
        for parameters in node["parameters"]:
            if isinstance(parameters, dict):
                words += [x for k, v in parameters.items() for x in ("-p", f"{k}:={resolved(v, arguments)}")]
            else:
                words += ["--params-file", resolved(parameters, arguments)]
        for topic, target in node.get("remappings", []):
            words += ["-r", f"{topic}:={resolved(target, arguments)}"]
        lines[node["name"]] = words
    return lines


@contextmanager
def started(lines: Mapping[str, list[str]], folder: Path) -> Iterator[dict[str, subprocess.Popen[bytes]]]:
    """All nodes as one process group's members are: ended by SIGINT, which must leave nothing."""
    running = {}
    for name, words in lines.items():
        with (folder / f"{name}.log").open("wb") as log:
            running[name] = subprocess.Popen(words, cwd=folder, stdout=log, stderr=log, start_new_session=True)
    try:
        yield running
        own = [lock for process in running.values() for lock in held_locks(process.pid)]
        own = [path for path in own if "fastrtps_port" not in path.name]
        assert len(own) >= len(running)
        for process in running.values():
            process.send_signal(signal.SIGINT)
        statuses = {name: process.wait(PATIENCE_S) for name, process in running.items()}
        assert statuses == dict.fromkeys(lines, 0)
        assert [path for path in own if path.exists()] == [], "shared memory that nobody holds"
    finally:
        for name, process in running.items():
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
            print(f"--- {name}\n{(folder / f'{name}.log').read_text(errors='replace')}")


def active(probe: Probe, name: str) -> bool:
    return str(probe.call(GetState, f"{name}/get_state").current_state.label) == "active"


def test_the_virtual_cell_in_a_namespace(probe: Probe, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    lines = commands("virtual_cell", {"namespace": "cell1"}, monkeypatch)
    assert set(lines) == {"virtual_cell", "puck_tracker", "recorder", "calibrator"}
    monkeypatch.setenv("ROS_HOME", str(tmp_path / "ros"))
    with started(lines, tmp_path):
        names = {f"/cell1/{name}" for name in lines}

        def found() -> set[str]:
            nodes = probe.node.get_node_names_and_namespaces()
            return {f"{space.rstrip('/')}/{name}" for name, space in nodes} & names

        until(lambda: found() == names, "all nodes in their namespace")
        heard = probe.listen(PoseWithCovarianceStamped, "/cell1/puck_tracker/puck1/pose", SENSOR)
        probe.wait_for(heard)
        assert all(active(probe, f"/cell1/{name}") for name in lines if name != "virtual_cell")
        (tmp_path / "shots.yaml").write_text("shots: [{x: -0.22, y: 0.07, angle: 0.05, velocity: 0.45}]")
        words = [sys.executable, "-m", "compass_ros.nodes.shooter", "--ros-args", "-r", "__ns:=/cell1"]
        words += ["-p", f"shots_file:={tmp_path / 'shots.yaml'}", "-p", "timeout_s:=100.0"]
        told = subprocess.run(words, cwd=tmp_path, check=True, capture_output=True, text=True, timeout=PATIENCE_S)
        bag = Path(json.loads(told.stdout)["bag"])
        assert bag == tmp_path / "ros" / "compass_ros" / "episodes" / "episode_0001", "not in the working directory"
        assert {topic.name: topic.messages > 100 for topic in list_topics(bag)}["/puck_tracker/puck1/pose"]
        assert {path.suffix for path in tmp_path.iterdir()} == {"", ".log", ".yaml"}


def test_the_real_cell_hears_the_camera_and_follows_the_simulated_clock(
    probe: Probe, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    lines = commands("cell", {"use_sim_time": "true", "prefix": "nice -n 1"}, monkeypatch)
    assert set(lines) == {"puck_tracker", "recorder", "calibrator"}
    monkeypatch.setenv("ROS_HOME", str(tmp_path / "ros"))
    with started(lines, tmp_path) as running:
        for topic in ("image_raw", "camera_info"):
            camera = f"/camera/camera/color/{topic}"
            until(lambda t=camera: probe.node.count_subscribers(t) == 1, f"a subscriber of {camera}")  # type: ignore[misc]
        niceness = {name: os.getpriority(os.PRIO_PROCESS, process.pid) for name, process in running.items()}
        assert niceness["puck_tracker"] == niceness["recorder"] == niceness["calibrator"] + 1
        diagnostics = probe.listen(DiagnosticArray, "/diagnostics")
        tick = probe.publisher(Clock, "/clock", RELIABLE)
        begun = time.monotonic()

        def heard_of(name: str) -> bool:
            message = Clock()
            message.clock.sec = 1000 + int(10 * (time.monotonic() - begun))  # ten times as fast as the wall's
            tick(message)
            return any(d.header.stamp.sec >= 1000 and name in d.status[0].name for d in diagnostics)

        for name in lines:
            until(lambda n=name: heard_of(n), f"diagnostics of {name} in simulated time")  # type: ignore[misc]
        assert max(d.header.stamp.sec for d in diagnostics) < 10_000, "nobody uses the wall's clock"

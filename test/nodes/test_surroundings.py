"""What is wrong around a node, in its parameters or with its home: said in one line where an operator looks."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from compass_ros_interfaces.msg import CalibrationStatus, EpisodeInfo
from compass_ros_interfaces.srv import StartEpisode, StopEpisode
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseWithCovarianceStamped
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from rosgraph_msgs.msg import Clock
from std_srvs.srv import Trigger

from test.nodes.conftest import StartNode
from test.nodes.episodes import TOPIC, pose
from test.nodes.harness import LATCHED, PATIENCE_S, RELIABLE, NodeProcess, Probe, until

pytestmark = pytest.mark.ros

WRONG_AT_THE_START: list[tuple[str, dict[str, Any], str]] = [
    ("recorder", {"depth": -5}, "depth"),
    ("recorder", {"max_duration_s": "ten"}, "max_duration_s"),
    ("recorder", {"topics": ["a b"]}, "'a b' is no name of a topic"),
    ("recorder", {"cell": "air\nhockey"}, "cell: expected printable letters"),
    ("calibrator", {"method": "magic"}, "unknown method 'magic'; available: causal-map"),
    ("calibrator", {"bags": [1, 2]}, "bags: expected a path or a list of paths"),
    ("calibrator", {"false_alarm": 2.0}, "false_alarm"),
    ("puck_tracker", {"object_names": ["puck1", "no name"]}, "no name"),
    ("puck_tracker", {"gate_m": -1.0}, "gate_m"),
    ("virtual_cell", {"real_time_factor": 0.0}, "real_time_factor"),
    ("shooter", {"timeout_s": -1.0}, "timeout_s"),
]


def test_wrong_parameters_end_a_start_with_one_line(domain: int, tmp_path: Path) -> None:
    started = []
    for number, (name, parameters, _) in enumerate(WRONG_AT_THE_START):
        folder = tmp_path / str(number)
        folder.mkdir()
        started.append(NodeProcess(name, folder, parameters, ()))
    for (name, _, words), node in zip(WRONG_AT_THE_START, started, strict=True):
        assert node.process.wait(PATIENCE_S) == 1, (name, node.output())
        last = node.output().splitlines()[-1]
        assert last.startswith(f"{name}: ")
        assert words in last
        assert "Traceback" not in node.output()


def test_an_empty_list_of_topics_is_refused_however_it_is_given(domain: int, tmp_path: Path) -> None:
    node = NodeProcess("recorder", tmp_path, {}, ("-p", "topics:=[]"))
    assert node.process.wait(PATIENCE_S) == 1
    assert "topics" in node.output().splitlines()[-1]
    assert "Traceback" not in node.output()


def value_of(given: Any) -> ParameterValue:
    """As any client may send it; None: not set."""
    for kind, code, field in (
        (bool, ParameterType.PARAMETER_BOOL, "bool_value"),
        (int, ParameterType.PARAMETER_INTEGER, "integer_value"),
        (float, ParameterType.PARAMETER_DOUBLE, "double_value"),
        (str, ParameterType.PARAMETER_STRING, "string_value"),
    ):
        if isinstance(given, kind):
            return ParameterValue(type=code, **{field: given})
    if given is None:
        return ParameterValue()
    if given and isinstance(given[0], int):
        return ParameterValue(type=ParameterType.PARAMETER_INTEGER_ARRAY, integer_array_value=given)
    return ParameterValue(type=ParameterType.PARAMETER_STRING_ARRAY, string_array_value=given)


def test_wrong_parameters_are_refused_with_the_reason_while_a_node_runs(
    start_node: StartNode, probe: Probe, tmp_path: Path
) -> None:
    nodes = {name: start_node(name, autostart=False, data_dir=str(tmp_path)) for name in ("recorder", "calibrator")}
    for name, parameter, given, words in (
        ("recorder", "depth", -1, "range"),
        ("recorder", "depth", 0, "range"),
        ("recorder", "depth", 10.0, "type"),
        ("recorder", "depth", None, "undeclared"),
        ("recorder", "topics", [], "expected one topic or more"),
        ("recorder", "topics", ["/a//b"], "'/a//b' is no name of a topic"),
        ("recorder", "topics", ["/a", "b c"], "'b c' is no name of a topic"),
        ("recorder", "topics", ["/a//*"], "'/a//*' is no name of a topic"),
        ("recorder", "topics", ["/a[0"], "'/a[0' is no name of a topic"),
        ("recorder", "topics", ["/a*", "/b c*"], "'/b c*' is no name of a topic"),
        ("recorder", "topics", ["/{a,b}/*"], "is no name of a topic"),
        ("recorder", "topics", ["~/*"], "'~/*' is no pattern of topics"),
        ("recorder", "buffer_s", -1, "range"),
        ("recorder", "directory", "a\x07b", "expected printable letters"),
        ("calibrator", "method", "", "unknown method ''"),
        ("calibrator", "method", "causal_map", "did you mean 'causal-map'"),
        ("calibrator", "bags", [3], "expected a path or a list of paths"),
        ("calibrator", "bags", True, "expected a path or a list of paths"),
        ("calibrator", "newest", 0, "range"),
        ("calibrator", "seed", -1, "range"),
    ):
        request = SetParameters.Request(parameters=[Parameter(name=parameter, value=value_of(given))])
        (answer,) = probe.call(SetParameters, f"/{name}/set_parameters", request).results
        assert not answer.successful, (name, parameter, given)
        assert words in answer.reason.lower() or words in answer.reason, answer.reason
    for node in nodes.values():
        assert node.process.poll() is None
        assert node.stop() == 0
        assert "Traceback" not in node.output()


def test_what_is_wrong_around_a_calibrator(start_node: StartNode, probe: Probe, tmp_path: Path) -> None:
    """Another one of its name, a clock that nobody moves, no recorder: in status, /diagnostics and log."""
    there = ("-r", "__ns:=/cell1", "-p", "use_sim_time:=true")
    own = {"data_dir": str(tmp_path / "data"), "cell": "pendulum_single"}
    node = start_node("calibrator", *there, **own)
    heard = probe.listen(CalibrationStatus, "/cell1/calibrator/status", LATCHED)
    diagnostics = probe.listen(DiagnosticArray, "/diagnostics")
    other = start_node("calibrator", *there, **own)
    wrong = (
        "another node is called /cell1/calibrator: services and goals reach either one; end one, or rename it",
        "use_sim_time is set and nobody publishes /clock: time stands at zero",
        "nobody publishes /cell1/recorder/status: new episodes are not heard of",
    )
    for problem in wrong:
        probe.wait_for(heard, lambda status, p=problem: p in status.problems)  # type: ignore[misc]
        probe.wait_for(diagnostics, lambda a, p=problem: p in a.status[0].message)  # type: ignore[misc]
        until(lambda p=problem: node.output().count(f": {p}") == 1, f"one line in the log: {problem}")  # type: ignore[misc]
    assert {status.name for array in diagnostics for status in array.status} == {
        "/cell1/calibrator: calibration", "/cell1/calibrator: simulator in force",
    }  # fmt: skip
    assert heard[-1].unit == "rad", "a pendulum has no metres"

    other.kill()
    tick = probe.publisher(Clock, "/clock", RELIABLE)
    probe.publisher(EpisodeInfo, "/cell1/recorder/status", RELIABLE)
    begun = time.monotonic()

    def better() -> bool:
        message = Clock()
        message.clock.sec, message.clock.nanosec = divmod(round(1e9 * (10 + time.monotonic() - begun)), 10**9)
        tick(message)
        return not set(wrong[1:]) & set(heard[-1].problems)

    until(better, "the end of two of the problems")
    until(lambda: "over: use_sim_time is set and nobody publishes /clock" in node.output(), "its end in the log")
    assert node.stop() == 0
    assert "Traceback" not in node.output()


def test_what_is_wrong_around_a_recorder(start_node: StartNode, probe: Probe, tmp_path: Path) -> None:
    """A topic without a publisher, one that stops in the middle; an episode without data, taken back afterwards."""
    node = start_node("recorder", data_dir=str(tmp_path), topics=[TOPIC, "/never"], min_free_mb=1)
    statuses = probe.listen(EpisodeInfo, "/recorder/status", LATCHED)
    diagnostics = probe.listen(DiagnosticArray, "/diagnostics")
    assert probe.call(StartEpisode, "/recorder/start_episode").success
    probe.wait_for(statuses, lambda s: "/never has no publisher" in s.message)
    until(lambda: node.output().count("/never has no publisher") == 1, "one line in the log")
    empty = probe.call(StopEpisode, "/recorder/stop_episode")
    assert empty.success
    assert empty.message == "no data: no message came on any topic, none has a publisher"
    assert Path(empty.info.bag) == tmp_path / "episodes" / "episode_0001"
    assert probe.call(Trigger, "/recorder/discard_episode").message == "discarded episode_0001"
    assert not Path(empty.info.bag).exists()
    gone = probe.wait_for(statuses, lambda s: s.state == EpisodeInfo.DISCARDED)
    assert gone.bag == empty.info.bag, "so that others can forget it"
    assert "there is no last one to discard" in probe.call(Trigger, "/recorder/discard_episode").message

    publish = probe.publisher(PoseWithCovarianceStamped, TOPIC)
    assert probe.call(StartEpisode, "/recorder/start_episode").success
    for number in range(100):
        publish(pose(number))
        time.sleep(0.005)
    probe.wait_for(statuses, lambda s: f"{TOPIC} has stopped: no message for" in s.message)
    probe.wait_for(diagnostics, lambda a: f"{TOPIC} has stopped: no message for" in a.status[0].message)
    until(lambda: node.output().count(f"{TOPIC} has stopped: no message for") == 1, "one line in the log")
    stopped = probe.call(StopEpisode, "/recorder/stop_episode")
    assert f"{TOPIC} stopped " in stopped.message
    assert "s before the end" in stopped.message
    assert all(s.name == "/recorder: episodes" for a in diagnostics for s in a.status)
    assert node.stop() == 0


HOMES: list[tuple[dict[str, str], str]] = [
    ({}, ""),
    ({"HOME": ""}, ""),
    ({"ROS_HOME": "{tmp}/ros"}, "{tmp}/ros/compass_ros"),
    ({"XDG_DATA_HOME": "{tmp}/data", "ROS_LOG_DIR": "{tmp}/log"}, "{tmp}/data/compass_ros"),
    ({"HOME": "{tmp}/ann"}, "{tmp}/ann/.local/share/compass_ros"),
]


def test_a_recorder_starts_without_a_home(domain: int, tmp_path: Path) -> None:
    """As systemd and containers start it; where a home is given in any way, that is where its bags go."""
    kept = {k: v for k, v in os.environ.items() if k not in ("HOME", "ROS_HOME", "ROS_LOG_DIR", "XDG_DATA_HOME")}
    started = []
    for number, (environment, data) in enumerate(HOMES):
        own = {name: text.format(tmp=tmp_path) for name, text in environment.items()}
        folder = Path(data.format(tmp=tmp_path) or tmp_path / str(number))
        words = [sys.executable, "-m", "compass_ros.nodes.recorder", "--ros-args", "-r", f"__node:=recorder{number}"]
        words += [] if data else ["-p", f"data_dir:={folder}"]  # the user's own home is not for tests
        log = tmp_path / f"{number}.log"
        with log.open("wb") as file:
            process = subprocess.Popen(words, env=kept | own, cwd=tmp_path, stdout=file, stderr=file)
        started.append((process, folder / "episodes", log))
    for process, episodes, log in started:
        until(lambda e=episodes, p=process: e.is_dir() or p.poll() is not None, str(episodes))  # type: ignore[misc]
        process.terminate()
        assert process.wait(PATIENCE_S) == 0, log.read_text()
    assert not (tmp_path / "out").exists()


def test_a_home_that_cannot_be_written_is_one_line_that_names_the_way_out(domain: int, tmp_path: Path) -> None:
    kept = {k: v for k, v in os.environ.items() if k not in ("ROS_HOME", "ROS_LOG_DIR", "XDG_DATA_HOME")}
    words = [sys.executable, "-m", "compass_ros.nodes.recorder"]
    done = subprocess.run(
        words, env=kept | {"HOME": "/proc/nobody"}, capture_output=True, text=True, cwd=tmp_path, check=False
    )
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1].startswith("recorder: failed to initialize logging")
    assert "ROS_LOG_DIR" in done.stderr.splitlines()[-1]
    assert "Traceback" not in done.stderr

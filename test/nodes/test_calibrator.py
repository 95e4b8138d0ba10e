"""The calibrator over DDS, in a process of its own, on bags whose truth is known."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from action_msgs.msg import GoalStatus
from compass_ros_interfaces.action import Calibrate
from compass_ros_interfaces.msg import CalibrationStatus, CausalGraph, EpisodeInfo, Mismatch, SimParameters
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rcl_interfaces.srv import DescribeParameters, ListParameters
from std_srvs.srv import Trigger

from compass_ros.reporting.kept import read_all
from test.nodes.conftest import StartNode
from test.nodes.harness import LATCHED, RELIABLE, Probe, until
from test.nodes.recordings import record

pytestmark = [pytest.mark.ros, pytest.mark.slow]

FRICTION = "puck1@dyna@friction_sliding"
STATUS = "/calibrator/status"


@pytest.fixture(scope="module")
def bags(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("bags")
    record(folder, {FRICTION: 0.1, "env@camera@bias_x": 0.02}, shots=4, seed=5)
    return folder


def in_state(state: int) -> Callable[[CalibrationStatus], bool]:
    return lambda status: bool(status.state == state)


def saying(*words: str) -> Callable[[CalibrationStatus], bool]:
    return lambda status: all(word in status.message for word in words)


def ended(status: CalibrationStatus) -> bool:
    return status.state not in (CalibrationStatus.IDLE, CalibrationStatus.RUNNING)


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def children(pid: int) -> list[int]:
    """Processes that a process has started and that still run."""
    return [
        int(child) for task in Path(f"/proc/{pid}/task").iterdir() for child in (task / "children").read_text().split()
    ]


def test_a_start_with_bags_publishes_what_result_json_says(
    bags: Path, tmp_path: Path, start_node: StartNode, probe: Probe
) -> None:
    output = tmp_path / "out" / "result"
    empty = shutil.copytree(min(bags.iterdir()), tmp_path / "empty")
    next(empty.glob("*.mcap")).write_bytes(b"")
    start_node("calibrator", bags=[str(bags), str(empty)], output=str(output), rollouts=600, seed=1)
    diagnostics = probe.listen(DiagnosticArray, "/diagnostics")
    heard = probe.listen(CalibrationStatus, STATUS, RELIABLE)
    status = probe.wait_for(heard, ended)
    assert (status.state, status.message) == (CalibrationStatus.SUCCEEDED, f"result in {output}")
    shares = [one.share_done for one in heard]
    assert shares == sorted(shares), "progress never runs backwards"
    assert shares[-1] == 1.0
    (left_out,) = status.left_out
    assert left_out.startswith(f"{empty} was left out: ")

    # All three arrive although this client subscribes after they were published.
    parameters = probe.wait_for(probe.listen(SimParameters, "/calibrator/sim_parameters", LATCHED))
    graph = probe.wait_for(probe.listen(CausalGraph, "/calibrator/causal_graph", LATCHED))
    mismatch = probe.wait_for(probe.listen(Mismatch, "/calibrator/mismatch", LATCHED))
    result = json.loads((output / "result.json").read_text())
    assert (parameters.cell, parameters.source) == ("air_hockey", str(output / "result.json"))
    assert [(row.name, row.value, row.active) for row in parameters.parameters] == [
        (row["name"], row["value"], row["active"]) for row in result["parameters"]
    ]
    assert len(graph.psi) == len(graph.parameters) * len(graph.factors)
    assert [*graph.psi[: len(graph.factors)]] == result["graph"]["psi"][0]
    assert graph.sparsity == result["graph"]["sparsity"]
    assert mismatch.verdict == result["mismatch"]["verdict"]
    nominal = next(gap for gap in mismatch.gaps if (gap.model, gap.episodes) == ("nominal", "fit"))
    assert dict(zip(nominal.factors, nominal.d, strict=True)) == result["gap"]["nominal"]["fit"]["d"]
    assert names(tmp_path / "out") == ["result"]
    typed = f"compass calibrate --cell air_hockey --method default --seed 1 --rollouts 600 --out {output} -- {bags}"
    assert read_all(output)[1].command == f"{typed} {empty}"
    assert [one["bag"] for one in result["episodes"]["left_out"]] == [str(empty)]

    said = probe.wait_for(
        diagnostics,
        lambda message: "calibration" in message.status[0].name and "succeeded" in message.status[0].message,
    )
    assert said.status[0].level == DiagnosticStatus.WARN
    assert left_out in said.status[0].message


def test_feedback_a_second_one_refused_and_cancel_within_a_second(
    bags: Path, tmp_path: Path, start_node: StartNode, probe: Probe
) -> None:
    output = tmp_path / "out" / "result"
    node = start_node("calibrator", output=str(output))
    heard = probe.listen(CalibrationStatus, STATUS, LATCHED)
    probe.wait_for(heard, in_state(CalibrationStatus.IDLE))
    action = probe.action(Calibrate, "/calibrator/calibrate")
    feedback: list[Any] = []
    goal = Calibrate.Goal(bags=[str(bags)], cell="air_hockey", seed=2)
    handle = probe.ask(action.send_goal_async, goal, feedback.append)
    assert handle.accepted
    until(lambda: any(one.feedback.share_done > 0 for one in feedback), "feedback with some share done")
    newest = feedback[-1].feedback
    assert newest.stage
    assert newest.seconds_left > 0
    assert children(node.process.pid)

    # The node answers while it calibrates, and says no.
    refused = probe.call(Trigger, "/calibrator/recalibrate")
    assert not refused.success
    assert refused.message.startswith("refused: a calibration is already running")
    second = probe.ask(action.send_goal_async, goal)
    assert not second.accepted
    assert probe.wait_for(heard, saying("already running")).state == CalibrationStatus.RUNNING

    answer = handle.get_result_async()
    probe.ask(handle.cancel_goal_async)
    cancelled = probe.result(answer)
    assert cancelled.status == GoalStatus.STATUS_CANCELED
    assert not cancelled.result.success
    assert probe.wait_for(heard, ended).state == CalibrationStatus.CANCELLED
    assert names(tmp_path / "out") == []
    assert children(node.process.pid) == []


def test_bad_input_is_one_line_and_the_node_goes_on(tmp_path: Path, start_node: StartNode, probe: Probe) -> None:
    start_node("calibrator", output=str(tmp_path / "out" / "result"))
    heard = probe.listen(CalibrationStatus, STATUS, LATCHED)
    action = probe.action(Calibrate, "/calibrator/calibrate")
    there = str(Path(__file__).parents[2] / "bags")
    (tmp_path / "out" / "mine").mkdir(parents=True)
    (tmp_path / "out" / "mine" / "thesis.tex").touch()
    for goal, words in (
        (Calibrate.Goal(), ["no bags"]),
        (Calibrate.Goal(bags=["/no/such/bag"]), ["/no/such/bag: no such bag"]),
        (Calibrate.Goal(bags=["/no/such/bag", "/nor/this"]), ["none of the other 1 can be used either"]),
        (Calibrate.Goal(bags=[str(tmp_path)]), [str(tmp_path), "no episodes"]),
        (Calibrate.Goal(bags=[there], cell="air_hokey"), ["air_hokey", "air_hockey"]),
        (Calibrate.Goal(bags=[there], output=str(tmp_path)), [str(tmp_path), "expected a folder in"]),
        (Calibrate.Goal(bags=[there], output=str(tmp_path / "out" / "mine")), ["out/mine", "not overwritten"]),
    ):
        assert not probe.ask(action.send_goal_async, goal).accepted
        refused = probe.wait_for(heard, saying(*words))
        assert refused.state == CalibrationStatus.FAILED
        assert refused.message.startswith("refused: ")
        assert "\n" not in refused.message
    assert names(tmp_path / "out") == ["mine"]


def test_the_end_of_the_node_ends_its_calibration(
    bags: Path, tmp_path: Path, start_node: StartNode, probe: Probe
) -> None:
    output = tmp_path / "out" / "result"
    node = start_node("calibrator", bags=[str(bags)], output=str(output))
    heard = probe.listen(CalibrationStatus, STATUS, LATCHED)
    probe.wait_for(heard, in_state(CalibrationStatus.RUNNING))
    until(lambda: children(node.process.pid) != [], "the calibration process")
    child = Path("/proc", str(children(node.process.pid)[0]))
    assert node.stop() == 0
    assert not child.exists()
    assert names(tmp_path / "out") == []
    assert "Traceback" not in node.output()


def test_finished_episodes_of_this_cell_are_calibrated_from(
    tmp_path: Path, start_node: StartNode, probe: Probe
) -> None:
    start_node("calibrator", output=str(tmp_path / "result"))
    say = probe.publisher(EpisodeInfo, "/recorder/status", RELIABLE)
    assert "no bags" in probe.call(Trigger, "/calibrator/recalibrate").message
    for state, cell, bag in (
        (EpisodeInfo.RECORDING, "air_hockey", "/a"),
        (EpisodeInfo.FINISHED, "push_i", "/b"),
        (EpisodeInfo.FINISHED, "air_hockey", "/c"),
        (EpisodeInfo.FINISHED, "air_hockey", "/c"),
    ):
        say(EpisodeInfo(state=state, cell=cell, bag=bag))
    heard = probe.listen(CalibrationStatus, STATUS, LATCHED)
    until(lambda: "/c: no such bag" in probe.call(Trigger, "/calibrator/recalibrate").message, "what it has heard of")
    refused = probe.wait_for(heard, saying("/c"))
    assert (refused.state, refused.message) == (CalibrationStatus.FAILED, "refused: /c: no such bag")
    say(EpisodeInfo(state=EpisodeInfo.DISCARDED, cell="air_hockey", bag="/c"))
    until(lambda: "no bags" in probe.call(Trigger, "/calibrator/recalibrate").message, "that nothing is left")


def test_every_parameter_says_what_it_is(start_node: StartNode, probe: Probe) -> None:
    start_node("calibrator")
    listed = probe.call(ListParameters, "/calibrator/list_parameters").result.names
    own = [name for name in listed if name != "use_sim_time" and "start_type_description" not in name]
    assert sorted(own) == [
        "autostart", "bags", "calibrate_at_start", "cell", "data_dir", "false_alarm", "frame", "method", "newest",
        "output", "resume", "rollouts", "running_check", "seed", "verdict_false_alarm", "versions",
    ]  # fmt: skip
    request = DescribeParameters.Request(names=own)
    described = probe.call(DescribeParameters, "/calibrator/describe_parameters", request).descriptors
    assert all(one.description for one in described)

"""The operator's day over DDS: a proposal is applied and taken back, episodes are checked, a map is drawn."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
import yaml
from compass_ros_interfaces.action import Calibrate
from compass_ros_interfaces.msg import CalibrationStatus, EpisodeInfo, Mismatch, SimParameters
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from nav_msgs.msg import OccupancyGrid
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

from compass_ros.cells import load
from test.nodes.conftest import StartNode
from test.nodes.harness import LATCHED, RELIABLE, Probe, until
from test.nodes.recordings import record
from test.operation.results import write_calibration

pytestmark = pytest.mark.ros

FRICTION = "puck1@dyna@friction_sliding"
TRUTH = {FRICTION: 0.1}


@pytest.fixture(scope="module")
def before(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    return record(tmp_path_factory.mktemp("before"), TRUTH, shots=10, seed=5)


@pytest.fixture(scope="module")
def after(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    return record(tmp_path_factory.mktemp("after"), {FRICTION: 0.03}, shots=14, seed=6)


@pytest.fixture
def output(tmp_path: Path, before: list[Path]) -> Path:
    """A calibration has ended, and found the truth."""
    cell = load("air_hockey")
    folder = write_calibration(tmp_path / "out" / "result", cell, TRUTH, held_out=[bag.name for bag in before[:4]])
    (folder / "origin.yaml").write_text(yaml.safe_dump({"bags": [str(bag) for bag in before], "seed": 5}))
    return folder


def value(message: SimParameters) -> float:
    return float(next(row.value for row in message.parameters if row.name == FRICTION))


def said(heard: list[DiagnosticArray], text: str, level: bytes = DiagnosticStatus.OK) -> bool:
    newest = [s for array in heard[-1:] for s in array.status if s.name.endswith("simulator in force")]
    return any(text in status.message and status.level == level for status in newest)


def test_proposed_applied_checked_and_taken_back(
    output: Path, before: list[Path], after: list[Path], start_node: StartNode, probe: Probe, tmp_path: Path
) -> None:
    versions = tmp_path / "versions"
    node = start_node("calibrator", output=str(output), versions=str(versions))
    applied = probe.listen(SimParameters, "/calibrator/applied_parameters", LATCHED)
    assert value(probe.wait_for(applied)) != 0.1, "a proposal is not in force"
    assert value(probe.wait_for(probe.listen(SimParameters, "/calibrator/sim_parameters", LATCHED))) == 0.1
    assert probe.wait_for(probe.listen(Mismatch, "/calibrator/mismatch", LATCHED)).verdict == "none"
    diagnostics = probe.listen(DiagnosticArray, "/diagnostics")
    probe.wait_for(diagnostics, lambda _: said(diagnostics, "parameters are proposed: look at the report"))
    assert probe.call(Trigger, "/calibrator/next_experiment").message == "ten slow shots along the left wall"

    answer = probe.call(Trigger, "/calibrator/apply")
    assert (answer.success, answer.message) == (True, f"applied: version 1, in {versions / 'air_hockey' / '0001'}")
    assert value(probe.wait_for(applied, lambda m: m.source.endswith("0001"))) == 0.1
    origin = yaml.safe_load((versions / "air_hockey" / "0001" / "origin.yaml").read_text())
    assert (origin["replaces"], origin["seed"], len(origin["bags"])) == (0, 5, 10)
    again = probe.call(Trigger, "/calibrator/apply")
    assert again.message == "nothing to apply: the last calibration is in force already, as version 1"

    say = probe.publisher(EpisodeInfo, "/recorder/status", RELIABLE)
    for bag in before[4:]:
        say(EpisodeInfo(state=EpisodeInfo.FINISHED, cell="air_hockey", bag=str(bag)))
    probe.wait_for(diagnostics, lambda _: said(diagnostics, "no sign that the gap has grown in 6 episodes"))
    for bag in after:
        say(EpisodeInfo(state=EpisodeInfo.FINISHED, cell="air_hockey", bag=str(bag)))
    probe.wait_for(diagnostics, lambda _: said(diagnostics, "please recalibrate", DiagnosticStatus.WARN))
    assert node.output().count("please recalibrate") == 1
    assert probe.wait_for(diagnostics).status[0].message == "idle", "it asks; it does not begin by itself"

    answer = probe.call(Trigger, "/calibrator/revert")
    assert answer.message == "reverted to version 0 (the cell as configured)"
    assert not probe.call(Trigger, "/calibrator/revert").success
    assert value(probe.wait_for(applied, lambda m: m is applied[-1] and m.source.startswith("version 0"))) != 0.1
    assert node.stop() == 0
    assert "Traceback" not in node.output()


def test_the_map_and_the_markers_come_to_those_who_look_later(
    output: Path, start_node: StartNode, probe: Probe, tmp_path: Path
) -> None:
    start_node("calibrator", output=str(output), versions=str(tmp_path / "versions"))
    grid = probe.wait_for(probe.listen(OccupancyGrid, "/calibrator/mismatch_map", LATCHED))
    assert grid.header.frame_id == "table"
    assert len(grid.data) == grid.info.width * grid.info.height
    known = [share for share in grid.data if share >= 0]
    assert known
    assert max(known) < 30, "the true parameters leave nothing but noise"
    markers = probe.wait_for(probe.listen(MarkerArray, "/calibrator/markers", LATCHED)).markers
    assert {m.ns for m in markers} >= {"puck1 recorded", "puck1 simulated", "puck2 recorded", "verdict"}
    assert all(len(m.points) > 50 for m in markers if m.ns.endswith("recorded"))


def test_bags_that_vanish_cost_the_map_and_not_the_node(
    output: Path, before: list[Path], start_node: StartNode, probe: Probe, tmp_path: Path
) -> None:
    (output / "origin.yaml").write_text(yaml.safe_dump({"bags": [str(tmp_path / "gone")]}))
    node = start_node("calibrator", output=str(output), versions=str(tmp_path / "versions"))
    diagnostics = probe.listen(DiagnosticArray, "/diagnostics")
    probe.wait_for(diagnostics, lambda _: said(diagnostics, "none of the recordings", DiagnosticStatus.WARN))
    assert probe.call(Trigger, "/calibrator/apply").success
    say = probe.publisher(EpisodeInfo, "/recorder/status", RELIABLE)
    lost = shutil.copytree(before[0], tmp_path / "lost")
    shutil.rmtree(lost)
    say(EpisodeInfo(state=EpisodeInfo.FINISHED, cell="air_hockey", bag=str(lost)))
    say(EpisodeInfo(state=EpisodeInfo.FINISHED, cell="air_hockey", bag=str(before[1])))
    probe.wait_for(diagnostics, lambda _: said(diagnostics, "no sign that the gap has grown in 1 episodes"))
    assert str(lost) in node.output()
    assert "Traceback" not in node.output()


def test_nothing_to_apply_nothing_to_revert(start_node: StartNode, probe: Probe, tmp_path: Path) -> None:
    start_node("calibrator", output=str(tmp_path / "result"), versions=str(tmp_path / "versions"))
    for service, words in (
        ("apply", "nothing to apply: no calibration has left a result in"),
        ("revert", "nothing to revert"),
        ("next_experiment", "no calibration has ended yet"),
    ):
        answer = probe.call(Trigger, f"/calibrator/{service}")
        assert not answer.success
        assert words in answer.message
    assert not (tmp_path / "versions").exists()


def test_hostile_goals_are_refused_in_one_line(start_node: StartNode, probe: Probe, tmp_path: Path) -> None:
    output = tmp_path / "home" / "result"
    node = start_node("calibrator", output=str(output), versions=str(tmp_path / "versions"))
    action = probe.action(Calibrate, "/calibrator/calibrate")
    heard = probe.listen(CalibrationStatus, "/calibrator/status", LATCHED)
    for goal, words in (
        (Calibrate.Goal(bags=["/b"], output="/etc/compass"), "output: expected a folder in"),
        (Calibrate.Goal(bags=["/b"], output=str(output / ".." / ".." / "elsewhere")), "output: expected a folder in"),
        (Calibrate.Goal(bags=["/b\n[FATAL] all is lost"]), "expected a path of printable letters"),
        (Calibrate.Goal(bags=["b"] * 20_000), "expected at most 10000 paths"),
        (Calibrate.Goal(bags=["b" * 200_000]), "File name too long"),
        (Calibrate.Goal(bags=["--help"]), "--help"),
        (Calibrate.Goal(bags=["/b"], cell="$(touch /tmp/owned)"), "touch"),
        (Calibrate.Goal(bags=["/b"], seed=2**64 - 1), "/b"),
    ):
        assert not probe.ask(action.send_goal_async, goal).accepted
        until(lambda w=words: any(w in status.message for status in heard), words)  # type: ignore[misc]
        message = next(status.message for status in heard if words in status.message)
        assert "\n" not in message
        assert len(message) <= 500
    assert node.process.poll() is None
    assert "Traceback" not in node.output()
    assert not (tmp_path / "elsewhere").exists()
    assert not (tmp_path / "home").exists()

"""The virtual cell as a process: what it shows, what it keeps to itself, and what the tracker makes of it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import yaml
from compass_ros_interfaces.msg import ShotCommand
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseWithCovarianceStamped
from rclpy.qos import QoSProfile
from sensor_msgs.msg import CameraInfo, JointState
from std_srvs.srv import Trigger

from compass_ros.cells import load
from compass_ros.concealed.law import Ingredient
from compass_ros.concealed.laws import LAWS
from compass_ros.concealed.stage import Secret, Stage
from compass_ros.nodes.images import stamp_ns
from compass_ros.simulation import Simulator
from test.nodes.conftest import StartNode
from test.nodes.harness import PATIENCE_S, Probe, until

pytestmark = pytest.mark.ros
IMAGES = QoSProfile(depth=60)
"""Reliable, as the displays of RViz and Foxglove ask."""
SHOT = {"x": -0.22, "y": 0.07, "angle": 0.05, "velocity": 0.45}
TRUTH = {"env@camera@bias_x": 0.03, "env@camera@bias_y": -0.02, "puck2@dyna@friction_sliding": 0.03}


def answer_of(stage: Stage) -> str:
    """The JSON of an answer, as far as the cell reads it."""
    secret = stage.secret
    effects = [{"name": i.law.name, "objects": i.objects, "shape": i.shape, "size": i.size} for i in secret.ingredients]
    names = [p.name for p in stage.cell.parameters]
    return json.dumps({"parameters": dict(zip(names, secret.values.tolist(), strict=True)), "effects": effects})


def command(**changes: float) -> ShotCommand:
    values = SHOT | changes
    return ShotCommand(cell="air_hockey", names=list(values), values=list(values.values()))


def test_a_shot_is_filmed_tracked_and_revealed_only_on_request(
    start_node: StartNode, probe: Probe, tmp_path: Path
) -> None:
    file = tmp_path / "truth.yaml"
    file.write_text(yaml.safe_dump(TRUTH))
    start_node("virtual_cell", hidden_parameters_file=str(file), real_time_factor=0.5)
    start_node("puck_tracker")
    stamps: list[int] = []
    note = stamps.append
    probe.node.create_subscription(CameraInfo, "/camera_info", lambda info: note(stamp_ns(info.header.stamp)), IMAGES)
    diagnostics = probe.listen(DiagnosticArray, "/diagnostics")
    joints = probe.listen(JointState, "/virtual_cell/joint_states", IMAGES)
    shots = probe.listen(ShotCommand, "/virtual_cell/shot")
    poses = {
        name: probe.listen(PoseWithCovarianceStamped, f"/puck_tracker/{name}/pose", IMAGES)
        for name in ("puck1", "puck2")
    }
    send = probe.publisher(ShotCommand, "/virtual_cell/command")
    probe.wait_for(poses["puck2"])

    send(command())
    shot = probe.wait_for(shots)
    start = stamp_ns(shot.header.stamp)
    assert dict(zip(shot.names, shot.values, strict=True)) == SHOT
    until(lambda: bool(stamps) and stamps[-1] > start + 2_600_000_000, "the end of the shot")

    gaps = np.diff([stamp for stamp in stamps if stamp > start - 400_000_000])
    assert np.abs(gaps - 1e9 / 60).max() <= 1, "an image was lost, or a stamp is not the sensor's"
    assert len({tuple(joint.position) for joint in joints}) > 10

    for d in diagnostics:
        print({v.key: v.value for v in d.status[0].values})
    # the tracker against a simulation of the same truth, which no topic has carried
    cell = load("air_hockey")
    values = np.array([TRUTH.get(p.name, p.default) for p in cell.parameters])
    action = np.array([SHOT[field.name] for field in cell.action])
    for name, heard in poses.items():
        seen = [p for p in heard if start <= stamp_ns(p.header.stamp) <= start + 2_450_000_000]
        seen = [p for p in seen if p.pose.covariance[0] < 0.003**2]
        time_s = np.array([(stamp_ns(p.header.stamp) - start) * 1e-9 for p in seen])
        truth = Simulator(cell).bodies(values, action, time_s)[name][:, :2]
        found = np.array([(p.pose.pose.position.x, p.pose.pose.position.y) for p in seen])
        error = np.linalg.norm(found - truth, axis=1)
        assert len(seen) > 120
        assert np.sqrt((error**2).mean()) < 0.001
        assert np.quantile(error, 0.99) < 0.003

    topics = {name for name, _ in probe.node.get_topic_names_and_types() if name.startswith("/virtual_cell/")}
    of_arm = {f"/virtual_cell/{name}" for name in ("joint_states", "joint_commands", "tool_pose")}
    assert topics == {"/virtual_cell/command", "/virtual_cell/shot"} | of_arm
    told = json.loads(probe.call(Trigger, "/virtual_cell/reveal").message)
    assert told["parameters"] == dict(zip([p.name for p in cell.parameters], values.tolist(), strict=True))
    assert told["effects"] == []


def test_bad_commands_are_refused_in_one_line(start_node: StartNode, probe: Probe) -> None:
    node = start_node("virtual_cell", real_time_factor=2.0)
    infos = probe.listen(CameraInfo, "/camera_info", IMAGES)
    shots = probe.listen(ShotCommand, "/virtual_cell/shot")
    send = probe.publisher(ShotCommand, "/virtual_cell/command")
    send(command(velocity=9.0))
    send(ShotCommand(cell="push_i", names=list(SHOT), values=list(SHOT.values())))
    send(ShotCommand(cell="air_hockey", names=["x"], values=[0.1]))
    send(command())
    send(command())
    probe.wait_for(shots)
    output = node.output()
    assert "velocity: expected 0.2 to 0.8, found 9.0" in output
    assert "for cell 'push_i', this is 'air_hockey'" in output
    assert "expected values of ['x', 'y', 'angle', 'velocity']" in output
    assert "refused, a shot is being played" in output
    assert len(shots) == 1
    assert node.stop() == 0, "in the middle of a shot"
    assert "Traceback" not in node.output()
    assert infos[0].width == 640


def test_a_concealed_law_is_played_and_revealed(start_node: StartNode, probe: Probe, tmp_path: Path) -> None:
    """The tracker sees the pucks where the law sends them, and not where the plain simulator would."""
    cell = load("air_hockey")
    tilt = Ingredient(LAWS["table_tilt"], shape={"x": 0.6, "y": 0.8, "warp": 0.0}, size=8.0)
    stage = Stage(cell, Secret(cell.defaults, (tilt,)))
    file = tmp_path / "answer.json"
    file.write_text(answer_of(stage))
    start_node("virtual_cell", answer_file=str(file), real_time_factor=0.5)
    start_node("puck_tracker")
    shots = probe.listen(ShotCommand, "/virtual_cell/shot")
    heard = probe.listen(PoseWithCovarianceStamped, "/puck_tracker/puck1/pose", IMAGES)
    send = probe.publisher(ShotCommand, "/virtual_cell/command")
    probe.wait_for(heard)
    send(command())
    start = stamp_ns(probe.wait_for(shots).header.stamp)
    until(lambda: stamp_ns(heard[-1].header.stamp) > start + 2_400_000_000, "the end of the shot")

    seen = [p for p in heard if start + 1_000_000_000 <= stamp_ns(p.header.stamp) <= start + 2_400_000_000]
    time_s = np.array([(stamp_ns(p.header.stamp) - start) * 1e-9 for p in seen])
    found = np.array([(p.pose.pose.position.x, p.pose.pose.position.y) for p in seen])
    action = np.array([SHOT[field.name] for field in cell.action])

    def error(of: Stage) -> float:
        return float(np.median(np.linalg.norm(found - of.bodies(action, time_s)["puck1"][:, :2], axis=1)))

    assert error(stage) < 0.001
    assert error(Stage(cell, Secret(cell.defaults))) > 0.01
    told = json.loads(probe.call(Trigger, "/virtual_cell/reveal").message)
    assert [effect["name"] for effect in told["effects"]] == ["table_tilt"]


def test_a_wrong_hidden_parameter_ends_the_node_with_one_line(start_node: StartNode, tmp_path: Path) -> None:
    file = tmp_path / "truth.yaml"
    file.write_text("puck1@dyna@dampin: -6\n")
    node = start_node("virtual_cell", hidden_parameters_file=str(file))
    assert node.process.wait(PATIENCE_S) == 1
    assert "did you mean 'puck1@dyna@damping'?" in node.output()
    assert "Traceback" not in node.output()

"""The arm of the virtual cell over DDS: recorded, read as a cell's input or signal, and true to what was played."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from compass_ros_interfaces.msg import ShotCommand
from compass_ros_interfaces.srv import StartEpisode, StopEpisode
from geometry_msgs.msg import PoseStamped
from rclpy.qos import QoSProfile
from sensor_msgs.msg import CameraInfo, JointState
from tf2_msgs.msg import TFMessage

from compass_ros.cells import load
from compass_ros.episodes.reader import read_episode
from compass_ros.nodes.images import stamp_ns
from compass_ros.operation.current import sources
from compass_ros.simulation import Simulator
from compass_ros.simulation.windows import drive
from test.nodes.conftest import StartNode
from test.nodes.harness import Probe, until

pytestmark = pytest.mark.ros
SHOT = {"x": -0.22, "y": 0.07, "angle": 0.05, "velocity": 0.45}
TRUTH = {"env@camera@bias_x": 0.03, "pusher@actuation@vel_discount": 0.85}
STATES = "/virtual_cell/joint_states"
STEP = 1e-5
RELIABLE = QoSProfile(depth=5000)
"""The test may be held up for seconds."""


def test_what_its_driver_says_is_what_it_did(start_node: StartNode, probe: Probe, tmp_path: Path) -> None:
    file = tmp_path / "truth.yaml"
    file.write_text(yaml.safe_dump(TRUTH))
    start_node("virtual_cell", hidden_parameters_file=str(file), real_time_factor=1.0)
    topics = [STATES, "/virtual_cell/shot"]
    start_node("recorder", directory=str(tmp_path / "bags"), topics=topics, min_free_mb=1)
    states = probe.listen(JointState, STATES, RELIABLE)
    told = probe.listen(JointState, "/virtual_cell/joint_commands", RELIABLE)
    poses = probe.listen(PoseStamped, "/virtual_cell/tool_pose", RELIABLE)
    frames = probe.listen(TFMessage, "/tf", RELIABLE)
    infos = probe.listen(CameraInfo, "/camera_info", RELIABLE)
    shots = probe.listen(ShotCommand, "/virtual_cell/shot")
    send = probe.publisher(ShotCommand, "/virtual_cell/command")
    for heard in (states, told, poses, frames):
        probe.wait_for(heard)
    started = probe.call(StartEpisode, "/recorder/start_episode", StartEpisode.Request(cell="air_hockey"))
    assert started.success, started.message
    send(ShotCommand(cell="air_hockey", names=list(SHOT), values=list(SHOT.values())))
    start = stamp_ns(probe.wait_for(shots).header.stamp)
    until(lambda: stamp_ns(infos[-1].header.stamp) > start + 2_600_000_000, "the end of the shot")
    assert probe.call(StopEpisode, "/recorder/stop_episode").success

    # Four readings an image, the last one at its stamp; counts; the drawn arm's joints beside the tool's axes.
    # Of what was published before a topic was discovered, each subscription has heard another part.
    end = start + 2_500_000_000
    states, told, poses, infos = (
        [one for one in heard if start <= stamp_ns(one.header.stamp) <= end] for heard in (states, told, poses, infos)
    )
    stamps = np.array([stamp_ns(state.header.stamp) for state in states])
    assert np.abs(np.diff(stamps) - 1e9 / 240).max() < 3
    assert {stamp_ns(info.header.stamp) for info in infos} <= set(stamps.tolist())
    assert states[0].name == ["shoulder", "elbow", "pusher_x", "pusher_y"]
    tool = np.array([state.position[2:] for state in states])
    np.testing.assert_allclose(tool / STEP, np.round(tool / STEP), atol=1e-4)
    assert not len(states[0].velocity)
    # Targets are as commanded, whatever the arm makes of them.
    speeds = {round(float(np.linalg.norm(one.velocity)), 9) for one in told}
    assert max(speeds) == pytest.approx(0.45)
    assert told[0].name == ["pusher_x", "pusher_y"]
    # Pose and frame say the same counts.
    by_stamp = dict(zip(stamps.tolist(), tool.tolist(), strict=True))
    assert len(poses) == len(told) == len(states) > 590
    for pose in poses:
        place = pose.pose.position
        assert [place.x, place.y] == by_stamp[stamp_ns(pose.header.stamp)]
        assert pose.header.frame_id == "table"
    (frame,) = frames[-1].transforms
    assert (frame.header.frame_id, frame.child_frame_id) == ("table", "tool")

    # Read as the measured path of a cell, the bag's pusher moves the pucks as they were moved.
    cell, base = load("air_hockey_tool"), load("air_hockey")
    (tool_input,) = [source for source in sources(cell) if source.drives]
    # The pucks are not tracked here: a signal of the same messages stands for them.
    signal = replace(tool_input, object="seen", drives=False)
    episode = read_episode(started.bag, [tool_input, signal], cell.name)
    (track,) = episode.inputs
    assert len(track.stamp_ns) > 600
    hidden = base.values({"pusher@actuation@vel_discount": 0.85, "env@camera@bias_x": 0.03})
    time = np.arange(0, 0.8, 0.02)
    action = np.array([SHOT[field.name] for field in base.action])
    expected = Simulator(base, threads=1).observe(hidden[None], action[None], time[None])
    wrong_arm = hidden.copy()
    wrong_arm[base.index("pusher@actuation@vel_discount")] = 0.5
    path = Simulator(cell, threads=1).driven([drive(cell, episode)])
    inputs = np.array([*action, 0.0])
    found = path.observe(wrong_arm[None], inputs[None], time[None])
    assert np.abs(found - expected).max() < 1e-3
    assert np.abs(expected[0, -1, :2] - expected[0, 0, :2]).max() > 0.05

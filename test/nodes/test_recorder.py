"""The recorder as a process over DDS: episodes, names, answers in time. What goes wrong is in test/faults."""

from __future__ import annotations

import time
from pathlib import Path

import pytest
from compass_ros_interfaces.msg import EpisodeInfo, ShotCommand
from compass_ros_interfaces.srv import StartEpisode, StopEpisode
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseWithCovarianceStamped
from mcap.reader import make_reader
from rclpy.serialization import deserialize_message, serialize_message
from rosbags.highlevel import AnyReader
from std_msgs.msg import String
from std_srvs.srv import Trigger

from compass_ros.episodes import read_episode
from test.episodes.planted import PUCK1, mcap_file
from test.nodes.conftest import StartNode
from test.nodes.episodes import TOPIC, pose
from test.nodes.harness import LATCHED, NodeProcess, Probe, until

pytestmark = pytest.mark.ros


def test_an_episode_over_dds(recorder: NodeProcess, probe: Probe) -> None:
    publish = probe.publisher(PoseWithCovarianceStamped, TOPIC)
    fire = probe.publisher(ShotCommand, "/virtual_cell/shot")
    statuses = probe.listen(EpisodeInfo, "/recorder/status", LATCHED)
    reports = probe.listen(DiagnosticArray, "/diagnostics")
    publish(pose(0))  # before the episode
    request = StartEpisode.Request(cell="air_hockey", cell_hash="a1b2")
    started = probe.call(StartEpisode, "/recorder/start_episode", request)
    assert started.success, started.message
    shot = ShotCommand(cell="air_hockey", names=["x", "velocity"], values=[-0.2, 0.4])
    shot.header.stamp.sec = 1
    fire(shot)
    sent = [pose(number) for number in range(1, 301)]
    for message in sent:
        publish(message)
        time.sleep(0.002)
    until(lambda: bool(statuses) and statuses[-1].messages == 302, "302 messages")
    refused = probe.call(StartEpisode, "/recorder/start_episode")
    assert (refused.success, "stop or discard it first" in refused.message) == (False, True)
    stopped = probe.call(StopEpisode, "/recorder/stop_episode")
    assert (stopped.success, stopped.message) == (True, "")
    assert (stopped.info.state, stopped.info.messages) == (EpisodeInfo.FINISHED, 302)
    finished = probe.wait_for(statuses, lambda status: status.state == EpisodeInfo.FINISHED)
    assert finished.bag == started.bag == stopped.info.bag

    found = read_episode(started.bag, PUCK1, "air_hockey", "a1b2")
    assert (found.name, found.start_ns) == ("episode_0001", 10**9)
    assert found.action == {"x": -0.2, "velocity": 0.4}
    assert found.tracks[0].value[:, 0].tolist() == list(range(1, 301))
    with mcap_file(Path(started.bag)).open("rb") as file:
        stored = [message.data for _, channel, message in make_reader(file).iter_messages() if channel.topic == TOPIC]
    assert stored == [serialize_message(message) for message in sent], "bytes as they were sent"
    with AnyReader([Path(started.bag)]) as reader:  # checks each type's hash against its text
        assert reader.message_count == 303
        qos = reader.topics[TOPIC].connections[0].ext.offered_qos_profiles  # type: ignore[union-attr]
        assert [profile.reliability.name for profile in qos] == ["RELIABLE"]
    assert probe.wait_for(reports).status[0].name == "/recorder: episodes"


def test_discard_and_names(recorder: NodeProcess, probe: Probe, tmp_path: Path) -> None:
    for name in ("../out", "/tmp/out", "..", "a/b"):
        answer = probe.call(StartEpisode, "/recorder/start_episode", StartEpisode.Request(episode=name))
        assert not answer.success
        assert "episode name" in answer.message
    for hostile, words in (
        ({"action_names": ["a", "b"], "action_values": [1.0]}, "found 2 names (2 distinct) and 1 values"),
        ({"action_names": ["a", "a"], "action_values": [1.0, 2.0]}, "found 2 names (1 distinct)"),
        ({"action_names": ["a"], "action_values": [float("nan")]}, "a: expected a finite number, found nan"),
        ({"action_names": ["a\n"], "action_values": [1.0]}, "action: expected up to 200 printable letters"),
        ({"cell": "air_hockey\n[FATAL] all is lost"}, "cell: expected up to 200 printable letters"),
        ({"cell_hash": "f" * 100_000}, "cell_hash: expected up to 200 printable letters"),
        ({"episode": "e" * 1_000_000}, "episode name 'eee"),
    ):
        answer = probe.call(StartEpisode, "/recorder/start_episode", StartEpisode.Request(**hostile))
        assert not answer.success
        assert words in answer.message
        assert "\n" not in answer.message
        assert len(answer.message) < 300
    assert probe.call(StartEpisode, "/recorder/start_episode", StartEpisode.Request(episode="mine")).success
    assert probe.call(Trigger, "/recorder/discard_episode").message == "discarded mine"
    assert not probe.call(StopEpisode, "/recorder/stop_episode").success
    assert [path.name for path in tmp_path.rglob("*") if path.is_dir()] == ["bags"]
    assert recorder.stop() == 0


def test_latched_topics_are_in_every_bag(start_node: StartNode, probe: Probe, tmp_path: Path) -> None:
    """One publisher, and three that each say something once."""
    topics = ["/robot_description", "/labels"]
    start_node("recorder", directory=str(tmp_path / "bags"), topics=topics, min_free_mb=1)
    said = [("/robot_description", "<robot/>"), ("/labels", "one"), ("/labels", "two"), ("/labels", "three")]
    publishers = [probe.publisher(String, topic, LATCHED) for topic, _ in said]  # each is there as long as it is held
    for publish, (_, text) in zip(publishers, said, strict=True):
        publish(String(data=text))
    reports = probe.listen(DiagnosticArray, "/diagnostics")
    probe.wait_for(reports, lambda report: "has no publisher" not in report.status[0].message)
    for _ in range(2):
        bag = probe.call(StartEpisode, "/recorder/start_episode").bag
        probe.call(StopEpisode, "/recorder/stop_episode")
        with mcap_file(Path(bag)).open("rb") as file:
            stored = [(channel.topic, message.data) for _, channel, message in make_reader(file).iter_messages(topics)]
        assert sorted((topic, deserialize_message(data, String).data) for topic, data in stored) == sorted(said)

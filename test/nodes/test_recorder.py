"""The recorder as a process over DDS: episodes, answers in time, topics that change, kills in the middle."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from compass_interfaces.msg import EpisodeInfo, ShotCommand
from compass_interfaces.srv import StartEpisode, StopEpisode
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PointStamped, PoseWithCovarianceStamped
from mcap.reader import make_reader
from rclpy.serialization import serialize_message
from rosbags.highlevel import AnyReader
from std_srvs.srv import Trigger

from compass_ros.episodes import list_topics, read_episode, recover
from compass_ros.errors import BagError
from test.episodes.planted import PUCK1, mcap_file
from test.nodes.conftest import StartNode
from test.nodes.harness import LATCHED, NodeProcess, Probe, until

pytestmark = pytest.mark.ros

TOPIC = PUCK1[0].topic
ANSWER_S = 0.2
Publish = Callable[[PoseWithCovarianceStamped], None]


def pose(number: int) -> PoseWithCovarianceStamped:
    message = PoseWithCovarianceStamped()
    message.header.frame_id = "table_frame"  # 11 letters: no padding, which ROS leaves uninitialised
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(10**9 + number * 10**6, 10**9)
    message.pose.pose.position.x = float(number)
    message.pose.covariance[0] = message.pose.covariance[7] = 1e-6
    return message


@pytest.fixture
def recorder(start_node: StartNode, tmp_path: Path) -> NodeProcess:
    return start_node("recorder", directory=str(tmp_path / "bags"), topics=[TOPIC, "/virtual_cell/shot"], min_free_mb=1)


def timed(probe: Probe, kind: Any, service: str, request: Any = None) -> Any:
    """The answer of a service, which must come in time; the client is connected before the clock runs."""
    client = probe.node.create_client(kind, service)
    assert client.wait_for_service(10), service
    before = time.monotonic()
    answer = probe.result(client.call_async(request or kind.Request()))
    assert time.monotonic() - before < ANSWER_S, f"{service} took {time.monotonic() - before:.3f} s"
    return answer


def test_an_episode_over_dds(recorder: NodeProcess, probe: Probe) -> None:
    publish = probe.publisher(PoseWithCovarianceStamped, TOPIC)
    fire = probe.publisher(ShotCommand, "/virtual_cell/shot")
    statuses = probe.listen(EpisodeInfo, "/recorder/status", LATCHED)
    reports = probe.listen(DiagnosticArray, "/diagnostics")
    publish(pose(0))  # before the episode
    request = StartEpisode.Request(cell="air_hockey", cell_hash="a1b2")
    started = timed(probe, StartEpisode, "/recorder/start_episode", request)
    assert started.success, started.message
    shot = ShotCommand(cell="air_hockey", names=["x", "velocity"], values=[-0.2, 0.4])
    shot.header.stamp.sec = 1
    fire(shot)
    sent = [pose(number) for number in range(1, 301)]
    for message in sent:
        publish(message)
        time.sleep(0.002)
    until(lambda: bool(statuses) and statuses[-1].messages == 302, 5, "302 messages")
    refused = timed(probe, StartEpisode, "/recorder/start_episode")
    assert (refused.success, "stop or discard it first" in refused.message) == (False, True)
    stopped = timed(probe, StopEpisode, "/recorder/stop_episode")
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
        answer = timed(probe, StartEpisode, "/recorder/start_episode", StartEpisode.Request(episode=name))
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
    assert timed(probe, StartEpisode, "/recorder/start_episode", StartEpisode.Request(episode="mine")).success
    assert timed(probe, Trigger, "/recorder/discard_episode").message == "discarded mine"
    assert not timed(probe, StopEpisode, "/recorder/stop_episode").success
    assert [path.name for path in tmp_path.rglob("*") if path.is_dir()] == ["bags"]
    assert recorder.stop() == 0


def test_a_topic_that_changes_its_type(recorder: NodeProcess, probe: Probe, domain: int) -> None:
    tracker = Probe(domain)
    publish_pose = tracker.publisher(PoseWithCovarianceStamped, TOPIC)
    started = timed(probe, StartEpisode, "/recorder/start_episode")
    statuses = probe.listen(EpisodeInfo, "/recorder/status", LATCHED)
    publish_pose(pose(1))
    probe.wait_for(statuses, lambda status: status.messages == 2)
    tracker.close()
    other = Probe(domain)
    other.publisher(PointStamped, TOPIC)(PointStamped())
    probe.wait_for(statuses, lambda status: status.messages == 3)
    stopped = timed(probe, StopEpisode, "/recorder/stop_episode")
    other.close()
    change = f"{TOPIC} changed from geometry_msgs/msg/PoseWithCovarianceStamped to geometry_msgs/msg/PointStamped"
    assert stopped.message == change
    assert sum(topic.messages for topic in list_topics(started.bag) if topic.name == TOPIC) == 2


def test_lost_messages_are_said(start_node: StartNode, probe: Probe, tmp_path: Path) -> None:
    """A recorder that is held up, with room for 5 messages, gets 100."""
    node = start_node("recorder", directory=str(tmp_path / "bags"), topics=[TOPIC], depth=5, min_free_mb=1)
    publish = probe.publisher(PoseWithCovarianceStamped, TOPIC)
    statuses = probe.listen(EpisodeInfo, "/recorder/status", LATCHED)
    timed(probe, StartEpisode, "/recorder/start_episode")
    publish(pose(0))
    probe.wait_for(statuses, lambda status: status.messages == 2)
    node.process.send_signal(signal.SIGSTOP)
    for number in range(1, 101):
        publish(pose(number))
    node.process.send_signal(signal.SIGCONT)
    publish(pose(101))
    probe.wait_for(statuses, lambda status: "lost" in status.message)
    stopped = probe.call(StopEpisode, "/recorder/stop_episode")
    lost = 102 - (stopped.info.messages - 1)
    assert lost > 0
    assert stopped.message == f"lost {lost} messages on {TOPIC}"


def test_an_episode_that_nobody_stops(start_node: StartNode, probe: Probe, tmp_path: Path) -> None:
    start_node("recorder", directory=str(tmp_path / "bags"), topics=[TOPIC], max_duration_s=1, min_free_mb=1)
    statuses = probe.listen(EpisodeInfo, "/recorder/status", LATCHED, connect=False)
    timed(probe, StartEpisode, "/recorder/start_episode")
    finished = probe.wait_for(statuses, lambda status: status.state == EpisodeInfo.FINISHED, 5)
    assert "ended by itself after 1 s" in finished.message


def test_two_recorders_on_one_folder(
    recorder: NodeProcess, probe: Probe, start_node: StartNode, tmp_path: Path
) -> None:
    probe.call(Trigger, "/recorder/discard_episode")  # the first one is up
    second = start_node("recorder", directory=str(tmp_path / "bags"))
    assert second.process.wait(10) == 1
    assert f"another recorder (process {recorder.process.pid}) records here" in second.output()
    assert "Traceback" not in second.output()


@pytest.mark.parametrize("seed", range(3))
def test_killed_in_an_episode(recorder: NodeProcess, probe: Probe, seed: int) -> None:
    """`test/faults/kill_recorder.py` does this 200 times."""
    publish = probe.publisher(PoseWithCovarianceStamped, TOPIC)
    started = timed(probe, StartEpisode, "/recorder/start_episode")
    sent_at = []
    for number in range(200 + 37 * seed):
        publish(pose(number))
        sent_at.append(time.monotonic())
        time.sleep(0.002)
    recorder.process.kill()
    killed_at = time.monotonic()
    recorder.process.wait()
    bag = Path(started.bag)
    with pytest.raises(BagError, match="truncated"):
        read_episode(bag, PUCK1)
    recover(bag)
    kept = read_episode(bag, PUCK1).tracks[0].value[:, 0].tolist()
    assert kept == list(range(len(kept)))
    assert len(kept) >= sum(at < killed_at - 0.1 for at in sent_at)


def test_interrupted_by_ctrl_c(recorder: NodeProcess, probe: Probe) -> None:
    publish = probe.publisher(PoseWithCovarianceStamped, TOPIC)
    statuses = probe.listen(EpisodeInfo, "/recorder/status", LATCHED, connect=False)
    started = timed(probe, StartEpisode, "/recorder/start_episode")
    publish(pose(0))
    probe.wait_for(statuses, lambda status: status.messages == 2)
    assert recorder.stop() == 0
    assert not (Path(started.bag) / "metadata.yaml").exists(), "an episode without an end does not claim to be whole"
    assert recover(started.bag).messages == 3

"""The recorder under fire: a process over DDS that is killed, held up, doubled, forgotten; topics that change."""

from __future__ import annotations

import signal
import time
from pathlib import Path

import pytest
from compass_ros_interfaces.msg import EpisodeInfo
from compass_ros_interfaces.srv import StartEpisode, StopEpisode
from geometry_msgs.msg import PointStamped, PoseWithCovarianceStamped
from std_srvs.srv import Trigger

from compass_ros.episodes import list_topics, read_episode, recover
from compass_ros.errors import BagError
from test.episodes.planted import PUCK1
from test.nodes.conftest import StartNode
from test.nodes.episodes import TOPIC, pose
from test.nodes.harness import LATCHED, PATIENCE_S, NodeProcess, Probe

pytestmark = pytest.mark.ros


def test_a_topic_that_changes_its_type(recorder: NodeProcess, probe: Probe, domain: int) -> None:
    tracker = Probe(domain)
    publish_pose = tracker.publisher(PoseWithCovarianceStamped, TOPIC)
    started = probe.call(StartEpisode, "/recorder/start_episode")
    statuses = probe.listen(EpisodeInfo, "/recorder/status", LATCHED)
    publish_pose(pose(1))
    probe.wait_for(statuses, lambda status: status.messages == 2)
    tracker.close()
    other = Probe(domain)
    other.publisher(PointStamped, TOPIC)(PointStamped())
    probe.wait_for(statuses, lambda status: status.messages == 3)
    stopped = probe.call(StopEpisode, "/recorder/stop_episode")
    other.close()
    change = f"{TOPIC} changed from geometry_msgs/msg/PoseWithCovarianceStamped to geometry_msgs/msg/PointStamped"
    assert stopped.message == change
    assert sum(topic.messages for topic in list_topics(started.bag) if topic.name == TOPIC) == 2


def test_lost_messages_are_said(start_node: StartNode, probe: Probe, tmp_path: Path) -> None:
    """A recorder that is held up, with room for 5 messages, gets 100."""
    node = start_node("recorder", directory=str(tmp_path / "bags"), topics=[TOPIC], depth=5, min_free_mb=1)
    publish = probe.publisher(PoseWithCovarianceStamped, TOPIC)
    statuses = probe.listen(EpisodeInfo, "/recorder/status", LATCHED)
    probe.call(StartEpisode, "/recorder/start_episode")
    publish(pose(0))
    probe.wait_for(statuses, lambda status: status.messages == 2)
    node.process.send_signal(signal.SIGSTOP)
    for number in range(1, 101):
        publish(pose(number))
    node.process.send_signal(signal.SIGCONT)
    publish(pose(101))

    def said(info: EpisodeInfo) -> str:
        """What has to be said when all 102 have come or are lost; the first of `messages` tells of the cell."""
        return f"lost {102 - (info.messages - 1)} messages on {TOPIC}"

    status = probe.wait_for(statuses, lambda status: status.message == said(status))
    stopped = probe.call(StopEpisode, "/recorder/stop_episode")
    assert 2 < stopped.info.messages < 103
    assert stopped.message == status.message == said(stopped.info)


def test_an_episode_that_nobody_stops(start_node: StartNode, probe: Probe, tmp_path: Path) -> None:
    start_node("recorder", directory=str(tmp_path / "bags"), topics=[TOPIC], max_duration_s=1, min_free_mb=1)
    statuses = probe.listen(EpisodeInfo, "/recorder/status", LATCHED, connect=False)
    probe.call(StartEpisode, "/recorder/start_episode")
    finished = probe.wait_for(statuses, lambda status: status.state == EpisodeInfo.FINISHED)
    assert "ended by itself after 1 s" in finished.message


def test_two_recorders_on_one_folder(
    recorder: NodeProcess, probe: Probe, start_node: StartNode, tmp_path: Path
) -> None:
    probe.call(Trigger, "/recorder/discard_episode")  # the first one is up
    second = start_node("recorder", directory=str(tmp_path / "bags"))
    assert second.process.wait(PATIENCE_S) == 1
    assert f"another recorder (process {recorder.process.pid}) records here" in second.output()
    assert "Traceback" not in second.output()


@pytest.mark.parametrize("seed", range(3))
def test_killed_in_an_episode(recorder: NodeProcess, probe: Probe, seed: int) -> None:
    """`test/faults/kill_recorder.py` does this 200 times."""
    publish = probe.publisher(PoseWithCovarianceStamped, TOPIC)
    statuses = probe.listen(EpisodeInfo, "/recorder/status", LATCHED)
    started = probe.call(StartEpisode, "/recorder/start_episode")
    long_before = 200 + 37 * seed
    for number in range(long_before):
        publish(pose(number))
        time.sleep(0.002)
    probe.wait_for(statuses, lambda status: status.messages > long_before)  # they have arrived
    for number in range(long_before, long_before + 60):  # 0.12 s: what arrived 0.1 s before the kill must be kept
        publish(pose(number))
        time.sleep(0.002)
    recorder.process.kill()
    recorder.process.wait()
    bag = Path(started.bag)
    with pytest.raises(BagError, match="truncated"):
        read_episode(bag, PUCK1)
    recover(bag)
    kept = read_episode(bag, PUCK1).tracks[0].value[:, 0].tolist()
    assert kept == list(range(len(kept)))
    assert len(kept) >= long_before


def test_interrupted_by_ctrl_c(recorder: NodeProcess, probe: Probe) -> None:
    publish = probe.publisher(PoseWithCovarianceStamped, TOPIC)
    statuses = probe.listen(EpisodeInfo, "/recorder/status", LATCHED, connect=False)
    started = probe.call(StartEpisode, "/recorder/start_episode")
    publish(pose(0))
    probe.wait_for(statuses, lambda status: status.messages == 2)
    assert recorder.stop() == 0
    assert not (Path(started.bag) / "metadata.yaml").exists(), "an episode without an end does not claim to be whole"
    assert recover(started.bag).messages == 3

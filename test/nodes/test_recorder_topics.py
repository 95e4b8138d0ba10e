"""What a recorder takes beside topics that it is told by name, over DDS: patterns, any type and QoS, afterwards."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest
from compass_ros_interfaces.msg import EpisodeInfo
from compass_ros_interfaces.srv import StartEpisode, StopEpisode
from geometry_msgs.msg import PoseStamped, Twist, WrenchStamped
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import Imu, JointState
from shape_msgs.msg import Plane
from std_msgs.msg import Float64MultiArray, String
from std_srvs.srv import Trigger
from stereo_msgs.msg import DisparityImage
from trajectory_msgs.msg import JointTrajectory
from visualization_msgs.msg import Marker

from compass_ros.episodes import Source, read_episode
from compass_ros.episodes.bag import RawMessage, scan
from test.nodes.conftest import StartNode
from test.nodes.harness import LATCHED, RELIABLE, SENSOR, Probe, until

pytestmark = pytest.mark.ros

MANY = QoSProfile(depth=50, durability=DurabilityPolicy.TRANSIENT_LOCAL, reliability=ReliabilityPolicy.RELIABLE)
LATCHED_LOOSELY = QoSProfile(
    depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL, reliability=ReliabilityPolicy.BEST_EFFORT
)
JOINTS = ("joint_1", "joint_2", "joint_3")

TAKEN: dict[str, tuple[type[Any], QoSProfile]] = {
    "/joint_states": (JointState, RELIABLE),
    "/arm/effort": (Float64MultiArray, SENSOR),
    "/arm/left/force": (WrenchStamped, RELIABLE),
    "/arm/plan": (JointTrajectory, MANY),
    "/arm/imu": (Imu, LATCHED_LOOSELY),
    "/tool1/pose": (PoseStamped, SENSOR),
    "/tool2/pose": (PoseStamped, RELIABLE),
    "/base/command": (Twist, LATCHED),
}
LEFT: dict[str, type[Any]] = {
    "/arm2": String,
    "/tool/pose": PoseStamped,
    "/tool12/pose": PoseStamped,
    "/base/odom": Twist,
    "/arm/_hidden/x": String,
}
PATTERNS = ["/joint_states", "/arm/*", "/tool?/pose", "/base/[a-d]*", "/nothing/*"]


def publisher(node: Node, kind: type[Any], topic: str, qos: QoSProfile) -> Callable[[Any], None]:
    """Publishes; nobody waits for a subscriber."""
    publish: Callable[[Any], None] = node.create_publisher(kind, topic, qos).publish
    return publish


def start(probe: Probe, recorder: str = "/recorder") -> Path:
    started = probe.call(StartEpisode, f"{recorder}/start_episode")
    assert started.success, started.message
    return Path(started.bag)


def stored(bag: Path) -> dict[str, list[bytes]]:
    found: dict[str, list[bytes]] = {}
    for item in scan(bag):
        if isinstance(item, RawMessage):
            found.setdefault(item.topic.name, []).append(item.data)
    return found


def said(messages: Sequence[bytes], kind: type[Any]) -> list[Any]:
    """What bytes say; those that fill them up to a multiple of four are anything."""
    return [deserialize_message(message, kind) for message in messages]


def test_patterns_types_and_qos(start_node: StartNode, probe: Probe, tmp_path: Path) -> None:
    """Eight topics of eight types and five QoS; five that only look alike; one that comes in the middle."""
    start_node("recorder", directory=str(tmp_path / "bags"), topics=PATTERNS, min_free_mb=1)
    statuses = probe.listen(EpisodeInfo, "/recorder/status", LATCHED)
    for topic, left in LEFT.items():
        publisher(probe.node, left, topic, RELIABLE)(left())
    publish = {topic: probe.publisher(kind, topic, qos) for topic, (kind, qos) in TAKEN.items()}
    probe.wait_for(statuses, lambda status: status.message == "no topic matches /nothing/*")
    bag = start(probe)
    sent = {topic: [kind()] * 3 for topic, (kind, _) in TAKEN.items()}
    for topic, messages in sent.items():
        for message in messages:
            publish[topic](message)
    late = probe.publisher(String, "/nothing/at/first")  # returns when the recorder is there
    late(String(data="late"))
    until(lambda: statuses[-1].messages == 1 + 3 * len(TAKEN) + 1 and not statuses[-1].message, "all, and no complaint")
    assert probe.call(StopEpisode, "/recorder/stop_episode").success
    found = stored(bag)
    assert found.pop("/compass/episode")
    assert said(found.pop("/nothing/at/first"), String) == [String(data="late")]
    assert {topic: said(messages, TAKEN[topic][0]) for topic, messages in found.items()} == sent


QOS_CHANGES: dict[str, Sequence[QoSProfile]] = {
    "reliable_then_sensor": (RELIABLE, SENSOR),
    "sensor_then_reliable": (SENSOR, RELIABLE),
    "latched_then_not": (LATCHED, RELIABLE),
    "not_then_latched": (RELIABLE, LATCHED),
    "latched_then_sensor": (LATCHED, SENSOR),
    "loosely_then_many": (LATCHED_LOOSELY, MANY),
}


def test_publishers_that_come_back_with_another_qos(
    start_node: StartNode, probe: Probe, domain: int, tmp_path: Path
) -> None:
    """Six drivers of a namespace are started again, in an episode; what each says then is in the bag."""
    cell = ("-r", "__ns:=/cell1")
    start_node("recorder", *cell, directory=str(tmp_path / "bags"), topics=["driver/*"], min_free_mb=1)
    statuses = probe.listen(EpisodeInfo, "/cell1/recorder/status", LATCHED)
    first = Probe(domain)
    publish = [first.publisher(String, f"/cell1/driver/{name}", before) for name, (before, _) in QOS_CHANGES.items()]
    bag = start(probe, "/cell1/recorder")
    for one in publish:
        one(String(data="first"))
    probe.wait_for(statuses, lambda status: status.messages == 1 + len(QOS_CHANGES))
    first.close()
    again = [publisher(probe.node, String, f"/cell1/driver/{name}", after) for name, (_, after) in QOS_CHANGES.items()]
    deadline = time.monotonic() + 30
    while time.monotonic() < deadline and statuses[-1].messages < 1 + 2 * len(QOS_CHANGES):
        for name, one in zip(QOS_CHANGES, again, strict=True):
            if probe.node.count_subscribers(f"/cell1/driver/{name}"):
                one(String(data="second"))
        time.sleep(0.1)
    probe.call(StopEpisode, "/cell1/recorder/stop_episode")
    found = stored(bag)
    second = String(data="second")
    assert [name for name in QOS_CHANGES if second not in said(found[f"/driver/{name}"], String)] == []


def test_what_is_not_recorded_or_not_kept_is_said(
    start_node: StartNode, probe: Probe, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Five packages are hidden from the recorder; a sixth topic is received all the same, and fills the buffer."""
    missing = {
        "nav_msgs": Odometry,
        "shape_msgs": Plane,
        "stereo_msgs": DisparityImage,
        "visualization_msgs": Marker,
        "trajectory_msgs": JointTrajectory,
    }
    for package in missing:
        (tmp_path / "hidden" / package).mkdir(parents=True)
        (tmp_path / "hidden" / package / "__init__.py").touch()
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path / 'hidden'}:{os.environ.get('PYTHONPATH', '')}")
    start_node("recorder", directory=str(tmp_path / "bags"), topics=["/x/*"], min_free_mb=1, buffer_s=60, buffer_mb=1)
    statuses = probe.listen(EpisodeInfo, "/recorder/status", LATCHED)
    for package, kind in missing.items():
        publisher(probe.node, kind, f"/x/{package}", RELIABLE)
    publish = probe.publisher(String, "/x/known")
    for _ in range(30):
        publish(String(data="x" * 50_000))
        time.sleep(0.01)

    def named(status: EpisodeInfo) -> bool:
        return all(f"/x/{p} is not recorded: the package {p} of {p}/msg/" in status.message for p in missing)

    probe.wait_for(statuses, named)
    probe.wait_for(statuses, lambda status: "s of 60 fit into buffer_mb: 1" in status.message)


def test_the_last_seconds_over_dds(start_node: StartNode, probe: Probe, tmp_path: Path) -> None:
    """Saved twice, in an episode that goes on and after it; an arm's joint states and what it was told long before."""
    start_node("recorder", directory=str(tmp_path / "bags"), topics=["/*"], min_free_mb=1, buffer_s=2, cell="arm")
    describe = probe.publisher(String, "/robot_description", LATCHED)
    describe(String(data="<robot/>"))
    publish = probe.publisher(JointState, "/joint_states", SENSOR)
    probe.call(Trigger, "/recorder/save_last")  # the client is found, and no time passes later
    running = start(probe)
    message = JointState(name=list(JOINTS), position=[0.0, 0.0, 0.0])
    count, bags = 0, []
    for ending in (2.5, 3.0):
        begun = time.monotonic()
        while time.monotonic() - begun < ending:
            count += 1
            message.header.stamp = probe.node.get_clock().now().to_msg()
            message.position = [float(count), 0.0, 0.0]
            publish(message)
            time.sleep(0.004)
        answer = probe.call(Trigger, "/recorder/save_last")
        assert answer.success, answer.message
        assert "the last 2.0 s" in answer.message or "the last 1.9 s" in answer.message
        bags.append(Path(answer.message.partition(": ")[0]))
        if len(bags) == 1:
            stopped = probe.call(StopEpisode, "/recorder/stop_episode")
            assert (stopped.success, stopped.message) == (True, "")
    source = Source("/joint_states", "joints", "joint_position", of=JOINTS)
    whole = read_episode(running, [source], "arm").tracks[0].value[:, 0]
    assert len(whole) > 30
    for bag in bags:
        episode = read_episode(bag, [source], "arm")
        numbers = episode.tracks[0].value[:, 0]
        assert numbers.tolist() == list(range(int(numbers[0]), int(numbers[-1]) + 1)), "nothing is missing"
        span_s = (episode.tracks[0].stamp_ns[-1] - episode.tracks[0].stamp_ns[0]) * 1e-9
        assert 1.5 < span_s < 2.05
        assert said(stored(bag)["/robot_description"], String) == [String(data="<robot/>")]
        assert "/recorder/status" not in stored(bag)

"""Latched messages are in every episode's bag, those too that came before the first; none is taken for its motion."""

from __future__ import annotations

from pathlib import Path

import pytest
from rosbags.typesys.stores import ros2_jazzy as ros

from compass_ros.episodes import read_episode, recover
from compass_ros.episodes.bag import RawMessage, scan
from compass_ros.episodes.definitions import POSE_TYPE, SHOT_TYPE, STRING_TYPE, embedded_definition
from compass_ros.episodes.latched import MOST_BYTES, Latched
from compass_ros.episodes.notes import Shot, encoded, shot_bytes
from compass_ros.episodes.recording import Connection, Recorder
from test.episodes.planted import PUCK1, START_NS, pose_bytes

TF_TYPE = "tf2_msgs/msg/TFMessage"
POSE_TOPIC = PUCK1[0].topic
LONG_AGO = START_NS - 600 * 10**9


def latched(topic: str, kind: str, publishers: int = 1) -> Connection:
    return Connection(topic, embedded_definition(kind), latched=publishers)


def text(content: str) -> bytes:
    return encoded(ros.std_msgs__msg__String(content), STRING_TYPE)


def transform(child: str) -> bytes:
    header = ros.std_msgs__msg__Header(ros.builtin_interfaces__msg__Time(0, 0), "base")
    identity = ros.geometry_msgs__msg__Transform(
        ros.geometry_msgs__msg__Vector3(0, 0, 0), ros.geometry_msgs__msg__Quaternion(0, 0, 0, 1)
    )
    stamped = ros.geometry_msgs__msg__TransformStamped(header, child, identity)
    return encoded(ros.tf2_msgs__msg__TFMessage([stamped]), TF_TYPE)


def stored(bag: str | Path, topic: str) -> list[bytes]:
    return [item.data for item in scan(Path(bag)) if isinstance(item, RawMessage) and item.topic.name == topic]


def episode(recorder: Recorder, now_ns: int = START_NS) -> str:
    recorder.start("", "", "", {}, now_ns)
    return recorder.stop().bag


@pytest.fixture
def recorder(tmp_path: Path) -> Recorder:
    return Recorder(tmp_path)


def test_one_publisher_its_last_message_is_in_every_bag(recorder: Recorder) -> None:
    recorder.connect(latched("/robot_description", STRING_TYPE))
    for version in ("<robot/>", "<robot name='second'/>"):
        recorder.take("/robot_description", text(version), LONG_AGO, LONG_AGO)
    for _ in range(3):
        assert stored(episode(recorder), "/robot_description") == [text("<robot name='second'/>")]


def test_several_publishers_each_ones_message_is_in_every_bag(recorder: Recorder) -> None:
    """Who is seen later counts too: its message may be here before it is seen."""
    recorder.connect(latched("/tf_static", TF_TYPE))
    sent = [transform(child) for child in ("camera", "tool", "table")]
    for data in sent:
        recorder.take("/tf_static", data, LONG_AGO, LONG_AGO)
    recorder.connect(latched("/tf_static", TF_TYPE, publishers=3))
    assert stored(episode(recorder), "/tf_static") == sent
    recorder.take("/tf_static", sent[0], LONG_AGO, LONG_AGO)  # a publisher that was started again
    assert stored(episode(recorder), "/tf_static") == [*sent[1:], sent[0]]


def test_what_comes_in_an_episode_is_in_it_once_and_in_the_next(recorder: Recorder) -> None:
    recorder.connect(latched("/robot_description", STRING_TYPE))
    recorder.take("/robot_description", text("old"), LONG_AGO, LONG_AGO)
    recorder.start("", "", "", {}, START_NS)
    recorder.take("/robot_description", text("new"), START_NS + 5, START_NS + 5)
    assert stored(recorder.stop().bag, "/robot_description") == [text("old"), text("new")]
    assert stored(episode(recorder), "/robot_description") == [text("new")]


def test_their_log_time_is_the_start_and_their_publish_time_their_own(recorder: Recorder) -> None:
    recorder.connect(latched("/robot_description", STRING_TYPE))
    recorder.take("/robot_description", text("r"), LONG_AGO, LONG_AGO)
    status = recorder.start("", "", "", {}, START_NS)
    assert (status.messages, status.duration_ns) == (2, 0)
    (item,) = [i for i in scan(Path(recorder.stop().bag)) if isinstance(i, RawMessage) and i.data == text("r")]
    assert item.log_ns == START_NS


def test_other_topics_start_empty(recorder: Recorder) -> None:
    recorder.connect(Connection("/chatter", embedded_definition(STRING_TYPE)))
    recorder.take("/chatter", text("before"), LONG_AGO, LONG_AGO)
    assert stored(episode(recorder), "/chatter") == []


def test_another_type_is_another_topic(recorder: Recorder) -> None:
    recorder.connect(latched("/map", STRING_TYPE))
    recorder.take("/map", text("old"), LONG_AGO, LONG_AGO)
    recorder.connect(latched("/map", TF_TYPE))
    assert stored(episode(recorder), "/map") == []


def test_a_latched_topic_that_is_not_latched_any_more(recorder: Recorder) -> None:
    recorder.connect(latched("/map", STRING_TYPE))
    recorder.take("/map", text("old"), LONG_AGO, LONG_AGO)
    recorder.connect(Connection("/map", embedded_definition(STRING_TYPE)))
    assert stored(episode(recorder), "/map") == []


def test_a_latched_pose_from_before_is_no_sample_of_the_motion(recorder: Recorder) -> None:
    recorder.connect(latched(POSE_TOPIC, POSE_TYPE))
    recorder.take(POSE_TOPIC, pose_bytes(LONG_AGO, x=9), LONG_AGO, LONG_AGO)
    recorder.start("", "", "", {}, START_NS)
    for frame in range(3):
        recorder.take(POSE_TOPIC, pose_bytes(START_NS + frame, x=frame), START_NS + frame, START_NS)
    bag = recorder.stop().bag
    assert read_episode(bag, PUCK1).tracks[0].value[:, 0].tolist() == [0, 1, 2]
    assert len(stored(bag, POSE_TOPIC)) == 4


def test_an_object_whose_pose_was_published_once_has_it(recorder: Recorder) -> None:
    recorder.connect(latched(POSE_TOPIC, POSE_TYPE))
    recorder.take(POSE_TOPIC, pose_bytes(LONG_AGO, x=9), LONG_AGO, LONG_AGO)
    assert read_episode(episode(recorder), PUCK1).tracks[0].value[:, 0].tolist() == [9]


@pytest.mark.parametrize("before_ns", [LONG_AGO, START_NS - 10**8])
def test_a_latched_shot_belongs_to_the_episode_in_which_it_came(recorder: Recorder, before_ns: int) -> None:
    recorder.connect(latched("/robot/shot", SHOT_TYPE))
    recorder.take("/robot/shot", shot_bytes(Shot(before_ns, "", {"v": 1})), before_ns, before_ns)
    assert read_episode(episode(recorder), ()).action == {}
    recorder.start("", "", "", {}, START_NS)
    recorder.take("/robot/shot", shot_bytes(Shot(START_NS, "", {"v": 2})), START_NS, START_NS)
    assert read_episode(recorder.stop().bag, ()).action == {"v": 2}


def test_they_are_in_a_recovered_bag(recorder: Recorder) -> None:
    recorder.connect(latched("/robot_description", STRING_TYPE))
    recorder.take("/robot_description", text("r"), LONG_AGO, LONG_AGO)
    bag = recorder.start("", "", "", {}, START_NS).bag
    recorder.close()
    recover(bag)
    assert stored(bag, "/robot_description") == [text("r")]


def test_memory_is_bounded() -> None:
    kept = Latched()
    for number in range(40):
        kept.keep(number, bytes([number]) * (MOST_BYTES // 10))
    assert [published for _, published in kept.standing(2)] == list(range(30, 40))
    kept.keep(40, bytes(2 * MOST_BYTES))
    assert [published for _, published in kept.standing(2)] == [40]

"""Episode to bag and back; the bag as others read it."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
import yaml
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader

from compass_ros.episodes import (
    Source,
    default_sources,
    list_topics,
    read_bag,
    read_episode,
    read_episodes,
    write_episode,
)
from compass_ros.errors import BagError
from compass_ros.types import Episode, Track
from test.episodes.planted import ALL, PUCKS, assert_same, digest, episode, mcap_file


def test_an_episode_comes_back_bit_for_bit(tmp_path: Path) -> None:
    planted = episode()
    bag = write_episode(planted, tmp_path)
    found = read_episode(bag, ALL, "air_hockey", "a1b2")
    assert_same(found, planted)
    assert found.source == str(bag)


def test_a_passive_episode_keeps_its_start(tmp_path: Path) -> None:
    planted = dataclasses.replace(episode(), action={}, initial_state={})
    assert_same(read_episode(write_episode(planted, tmp_path), ALL), planted)


def test_the_same_episode_gives_the_same_bytes(tmp_path: Path) -> None:
    one = write_episode(episode(seed=3), tmp_path / "one")
    other = write_episode(episode(seed=3), tmp_path / "other")
    different = write_episode(episode(seed=4), tmp_path / "different")
    assert digest(one) == digest(other) != digest(different)


def test_tracks_come_from_the_topics_that_they_were_given(tmp_path: Path) -> None:
    sources = [Source("/camera/a", "puck1"), Source("/camera/b", "puck2"), *ALL[2:]]
    bag = write_episode(episode(), tmp_path, sources)
    assert_same(read_episode(bag, sources), episode())
    assert "/camera/a" in {topic.name for topic in list_topics(bag)}


def test_episodes_are_sorted_whatever_the_order_of_their_bags(tmp_path: Path) -> None:
    bags = [write_episode(episode(f"shot_{number}", seed=number), tmp_path) for number in (3, 1, 2)]
    assert [found.name for found in read_episodes(bags, PUCKS)] == ["shot_1", "shot_2", "shot_3"]
    assert [found.name for found in read_episodes([tmp_path], PUCKS)] == ["shot_1", "shot_2", "shot_3"]
    assert len(read_episodes([tmp_path, bags[0], bags[0]], PUCKS)) == 3


def test_rosbags_and_mcap_read_the_same_numbers(tmp_path: Path) -> None:
    planted = episode()
    bag = write_episode(planted, tmp_path)
    with AnyReader([bag]) as reader:  # compares the type hashes as well
        wanted = [c for c in reader.connections if c.topic == PUCKS[0].topic]
        poses = [reader.deserialize(raw, connection.msgtype) for connection, _, raw in reader.messages(wanted)]
        assert reader.message_count == sum(topic.messages for topic in list_topics(bag))
    xy = [[pose.pose.pose.position.x, pose.pose.pose.position.y] for pose in poses]  # type: ignore[attr-defined]
    np.testing.assert_array_equal(xy, planted.track("puck1").value)
    with mcap_file(bag).open("rb") as file:
        decoded = list(make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages(PUCKS[0].topic))
    np.testing.assert_array_equal([item.decoded_message.pose.pose.position.x for item in decoded], np.array(xy)[:, 0])


def test_metadata_is_that_of_rosbag2_version_9(tmp_path: Path) -> None:
    bag = write_episode(episode(), tmp_path)
    content = yaml.safe_load((bag / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert content["version"] == 9
    assert content["storage_identifier"] == "mcap"
    assert content["relative_file_paths"] == ["shot_0.mcap"]
    counts = {t["topic_metadata"]["name"]: t["message_count"] for t in content["topics_with_message_count"]}
    assert counts[PUCKS[0].topic] == 60
    assert content["message_count"] == content["files"][0]["message_count"] == sum(counts.values())
    assert all(t["topic_metadata"]["type_description_hash"] for t in content["topics_with_message_count"])
    assert "&" not in (bag / "metadata.yaml").read_text(), "anchors"


def test_unknown_messages_are_listed_and_left_alone(tmp_path: Path) -> None:
    content = read_bag(write_episode(episode(), tmp_path), PUCKS)
    assert len(content.episode.tracks) == 2
    known = {topic.name: topic.known for topic in content.topics}
    assert known["/joint_states"]
    assert all(known.values())


@pytest.mark.parametrize(
    "name", ["", "..", "../x", "/tmp/x", "a/b", "a\\b", ".hidden", "a..b", "x" * 101, "new\nline", "é"]
)
def test_names_that_leave_the_folder_are_refused(name: str, tmp_path: Path) -> None:
    with pytest.raises(BagError, match="episode name"):
        write_episode(dataclasses.replace(episode(), name=name), tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_a_bag_is_never_written_over(tmp_path: Path) -> None:
    bag = write_episode(episode(), tmp_path)
    before = digest(bag)
    with pytest.raises(BagError, match="exists already"):
        write_episode(episode(seed=1), tmp_path)
    assert digest(bag) == before


def test_a_stamp_that_ros_cannot_hold_is_refused(tmp_path: Path) -> None:
    early = Episode("early", "", "", {}, -5, (Track("puck1", "xy", np.array([1]), np.zeros((1, 2))),))
    with pytest.raises(BagError, match="-5 ns does not fit"):
        write_episode(early, tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_default_sources_are_the_trackers_topics() -> None:
    assert default_sources(["puck1"])[0] == Source("/puck_tracker/puck1/pose", "puck1", "xy")

"""Bad bags: each gets one line that says which file, what was expected and what was found."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from compass_ros.episodes import Source, list_topics, read_bag, read_episode, read_episodes, write_episode
from compass_ros.episodes.bag import RawMessage, decode
from compass_ros.episodes.definitions import (
    EPISODE_TYPE,
    EPISODE_TYPES,
    SHOT_TYPE,
    SHOT_TYPES,
    STRING_TYPE,
    embedded_definition,
    typestore,
)
from compass_ros.episodes.notes import (
    EPISODE_TOPIC,
    NOTES_TOPIC,
    EpisodeHeader,
    Shot,
    encoded,
    header_bytes,
    shot_bytes,
)
from compass_ros.episodes.writer import BagWriter
from compass_ros.errors import BagError
from test.episodes.planted import ALL, PUCK1, PUCKS, START_NS, episode, mcap_file, pose_bag, pose_bytes

MS = 1_000_000


def complaint(path: Path, sources: tuple[Source, ...] = PUCKS, cell: str = "", cell_hash: str = "") -> str:
    """The one line that reading a bad bag gives; it names the bag."""
    with pytest.raises(BagError) as caught:
        read_episode(path, sources, cell, cell_hash)
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)
    return str(caught.value)


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    return write_episode(episode(), tmp_path)


def test_missing(tmp_path: Path) -> None:
    assert "no such bag" in complaint(tmp_path / "nowhere")


def test_no_episodes_at_all(tmp_path: Path) -> None:
    for paths in ([], [tmp_path]):
        with pytest.raises(BagError, match="no episodes"):
            read_episodes(paths, PUCKS)


def test_a_folder_without_a_bag(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("hello")
    assert "expected a bag" in complaint(tmp_path)
    assert "expected a bag" in complaint(tmp_path / "notes.txt")


def test_empty(tmp_path: Path) -> None:
    assert "empty" in complaint(pose_bag(tmp_path / "bag", [], []))


def test_empty_file(bag: Path) -> None:
    mcap_file(bag).write_bytes(b"")
    assert "truncated" in complaint(bag)


@pytest.mark.parametrize("content", [b"hello", b"\x89PNG\r\n\x1a\n" + bytes(99)])
def test_a_file_that_is_no_mcap_is_not_called_cut_off(bag: Path, content: bytes) -> None:
    mcap_file(bag).write_bytes(content)
    assert complaint(bag).endswith("shot_0.mcap: expected MCAP, found a file that does not begin as one")


@pytest.mark.parametrize("share", [0.0, 0.01, 0.3, 0.9, 0.999])
def test_truncated_file(bag: Path, share: float) -> None:
    file = mcap_file(bag)
    file.write_bytes(file.read_bytes()[: int(share * file.stat().st_size)])
    assert f"run: compass record --recover {bag}" in complaint(bag)


def test_deleted_file(bag: Path) -> None:
    mcap_file(bag).unlink()
    assert "which is missing" in complaint(bag)


def test_flipped_bits_in_the_data_are_noticed(bag: Path) -> None:
    """The last byte of a pose's covariance: nothing but the checksum can tell."""
    file = mcap_file(bag)
    content = bytearray(file.read_bytes())
    content[content.rindex(b"shot", 0, len(content) // 2) + 1] ^= 1
    file.write_bytes(content)
    assert "damaged" in complaint(bag)


def test_metadata_of_more_messages(bag: Path) -> None:
    path = bag / "metadata.yaml"
    content = yaml.safe_load(path.read_text())
    content["rosbag2_bagfile_information"]["message_count"] += 1
    path.write_text(yaml.safe_dump(content))
    assert "damaged: metadata.yaml says 274 messages, the files hold 273" in complaint(bag)


@pytest.mark.parametrize("text", ["", "[]", "x: 1", "a: [", "rosbag2_bagfile_information: 3", "\x00", "&a [*a]"])
def test_metadata_that_is_none(bag: Path, text: str) -> None:
    (bag / "metadata.yaml").write_text(text)
    assert "expected a rosbag2 metadata.yaml" in complaint(bag)


@pytest.mark.parametrize("name", ["/etc/passwd", "../secret.mcap", "../../x"])
def test_metadata_that_names_files_elsewhere(bag: Path, name: str) -> None:
    (bag.parent / "secret.mcap").write_bytes(mcap_file(bag).read_bytes())
    path = bag / "metadata.yaml"
    path.write_text(path.read_text().replace("shot_0.mcap", name))
    assert "which is missing" in complaint(bag)


def test_foreign(tmp_path: Path) -> None:
    message = complaint(pose_bag(tmp_path / "bag", [START_NS], [(0, 0)]), (Source("/puck_tracker/puck1/pos", "puck1"),))
    assert "did you mean '/puck_tracker/puck1/pose'" in message


def test_of_another_cell(bag: Path) -> None:
    assert "expected 'push_i', found 'air_hockey'" in complaint(bag, cell="push_i")
    assert "expected configuration ffff, found a1b2" in complaint(bag, cell="air_hockey", cell_hash="ffff")
    assert "say `recorded_as: ['a1b2']` in the cell" in complaint(bag, cell="air_hockey", cell_hash="ffff")
    assert read_episode(bag, PUCKS, "air_hockey", ("ffff", "a1b2")).cell_hash == "a1b2"


def test_topic_of_another_type(bag: Path) -> None:
    assert "is a compass_ros_interfaces/msg/ShotCommand; expected" in complaint(
        bag, (Source("/virtual_cell/shot", "puck1"),)
    )


def test_quantity_that_the_message_does_not_hold(bag: Path) -> None:
    assert "holds no 'joint' of puck1" in complaint(bag, (Source(PUCKS[0].topic, "puck1", "joint"),))


def test_joint_that_is_not_there(bag: Path) -> None:
    said = complaint(bag, (Source("/joint_states", "knee", "joint"),))
    assert "no messages of 'knee' on /joint_states (knee was never seen); there are " in said


@pytest.mark.parametrize("bad", [float("nan"), float("inf"), -float("inf")])
def test_poses_that_are_not_finite_are_left_out_and_counted(tmp_path: Path, bad: float) -> None:
    stamps = [START_NS + i * MS for i in range(5)]
    found = read_episode(pose_bag(tmp_path / "bag", stamps, [(0.0, 0.0)] * 3 + [(0.0, bad), (0.0, 0.0)]), PUCK1)
    assert found.tracks[0].stamp_ns.tolist() == stamps[:3] + stamps[4:]
    (remark,) = found.remarks
    assert "1 of 5 messages of puck1" in remark
    assert remark.endswith("(1 without a number): number 4")
    nothing = complaint(pose_bag(tmp_path / "lost", stamps, [(0.0, bad)] * 5), PUCK1)
    assert "nothing is left of puck1" in nothing


def test_covariance_that_is_not_finite(tmp_path: Path) -> None:
    bag = pose_bag(tmp_path / "bag", [START_NS], [(0, 0)], variance=float("nan"))
    assert "standard deviation of puck1 is not finite" in complaint(bag, PUCK1)


def test_stamps_out_of_order(tmp_path: Path) -> None:
    stamps = [START_NS, START_NS + 3 * MS, START_NS + MS]
    found = complaint(pose_bag(tmp_path / "bag", stamps, [(0, 0), (1, 0), (2, 0)]), PUCK1)
    assert f"stamps out of order: message 3 of puck1 is stamped {stamps[2]} ns, {2 * MS} ns before" in found


def test_one_stamp_with_two_poses(tmp_path: Path) -> None:
    found = complaint(pose_bag(tmp_path / "bag", [START_NS, START_NS], [(0, 0), (1, 0)]), PUCK1)
    assert "as is the one before it" in found


def test_a_message_that_came_twice_counts_once(tmp_path: Path) -> None:
    bag = pose_bag(tmp_path / "bag", [START_NS, START_NS, START_NS + 1], [(1, 2), (1, 2), (3, 4)])
    assert read_episode(bag, PUCK1).tracks[0].value.tolist() == [[1, 2], [3, 4]]


def test_a_bag_that_says_nothing_of_itself(tmp_path: Path) -> None:
    found = read_episode(pose_bag(tmp_path / "mine", [START_NS], [(1, 2)]), PUCK1, "my_cell", "my_hash")
    assert (found.name, found.cell, found.cell_hash, found.start_ns) == ("mine", "my_cell", "", START_NS)
    assert found.action == {}
    assert found.tracks[0].std is None


def with_messages(folder: Path, *messages: tuple[str, str, bytes]) -> Path:
    """A bag with one pose of puck1 and these (topic, type, bytes)."""
    writer = BagWriter(folder)
    every = [*messages, (PUCK1[0].topic, "geometry_msgs/msg/PoseWithCovarianceStamped", pose_bytes(START_NS))]
    channels = {topic: writer.add_topic(topic, embedded_definition(kind)) for topic, kind, _ in every}
    for topic, _, data in every:
        writer.write(channels[topic], START_NS, START_NS, data)
    writer.close()
    return folder


def fired(at_ns: int, **action: float) -> bytes:
    return shot_bytes(Shot(at_ns, "air_hockey", action))


def test_two_shots_are_no_episode(tmp_path: Path) -> None:
    bag = with_messages(
        tmp_path / "b", ("/a/shot", SHOT_TYPE, fired(START_NS)), ("/a/shot", SHOT_TYPE, fired(START_NS + 1))
    )
    assert "expected one shot an episode, found 2" in complaint(bag, PUCK1)


def test_the_shot_of_an_earlier_episode_is_left_out(tmp_path: Path) -> None:
    """A latched shot arrives again when a recorder connects."""
    head = header_bytes(EpisodeHeader("finished", "e", start_ns=START_NS))
    old, new = fired(START_NS - 5 * 10**9, v=1), fired(START_NS + MS, v=2)
    bag = with_messages(
        tmp_path / "b", (EPISODE_TOPIC, EPISODE_TYPE, head), ("/a/shot", SHOT_TYPE, old), ("/a/shot", SHOT_TYPE, new)
    )
    found = read_episode(bag, PUCK1)
    assert found.action == {"v": 2}
    assert found.start_ns == START_NS + MS


@pytest.mark.parametrize("shot_type", sorted(SHOT_TYPES))
@pytest.mark.parametrize("head_type", sorted(EPISODE_TYPES))
def test_bags_of_every_version_say_their_shot_and_their_episode(tmp_path: Path, head_type: str, shot_type: str) -> None:
    """Version 0.1 called the interface package otherwise."""
    head = header_bytes(EpisodeHeader("finished", "seventh", "air_hockey", "abc", START_NS))
    bag = with_messages(tmp_path / "b", (EPISODE_TOPIC, head_type, head), ("/a/shot", shot_type, fired(START_NS, v=2)))
    found = read_bag(bag, PUCK1)
    assert (found.episode.name, found.episode.cell_hash, found.episode.action) == ("seventh", "abc", {"v": 2})
    assert {topic.type for topic in found.topics if topic.known} >= {head_type, shot_type}


def test_the_robots_own_shot_goes_before_the_operators(tmp_path: Path) -> None:
    messages = (
        ("/compass/shot", SHOT_TYPE, fired(START_NS, v=1)),
        ("/robot/shot", SHOT_TYPE, fired(START_NS + MS, v=2)),
    )
    assert read_episode(with_messages(tmp_path / "both", *messages), PUCK1).action == {"v": 2}
    assert read_episode(with_messages(tmp_path / "one", messages[0]), PUCK1).action == {"v": 1}


def test_shots_that_are_not_finite(tmp_path: Path) -> None:
    bag = with_messages(tmp_path / "b", ("/shot", SHOT_TYPE, fired(START_NS, v=float("nan"))))
    assert "not finite: {'v': nan}" in complaint(bag, PUCK1)


@pytest.mark.parametrize(
    "text", ["", "[]", '{"initial_state": {"puck1": [1, "x"]}}', '{"std": {"a": []}}', "[" * 10**5]
)
def test_notes_that_are_none(tmp_path: Path, text: str) -> None:
    note = encoded(typestore().types[STRING_TYPE](data=text), STRING_TYPE)
    assert "not the notes of an episode" in complaint(
        with_messages(tmp_path / "b", (NOTES_TOPIC, STRING_TYPE, note)), PUCK1
    )


def test_other_messages_are_listed(tmp_path: Path) -> None:
    kind = "visualization_msgs/msg/Marker"
    content = read_bag(with_messages(tmp_path / "b", ("/markers", kind, b"\x00\x01\x00\x00")), PUCK1)
    unknown = [(topic.name, topic.type, topic.messages) for topic in content.topics if not topic.known]
    assert unknown == [("/markers", kind, 1)]


def test_bytes_that_are_not_the_type(tmp_path: Path) -> None:
    bag = with_messages(tmp_path / "b", ("/shot", SHOT_TYPE, b"\x00\x01\x00\x00\x05"))
    assert "a message is not a compass_ros_interfaces/msg/ShotCommand" in complaint(bag, PUCK1)


def test_another_version_of_a_message_is_not_guessed(tmp_path: Path) -> None:
    other = replace(embedded_definition(SHOT_TYPE), digest="RIHS01_" + "0" * 64)
    writer = BagWriter(tmp_path / "bag")
    writer.write(writer.add_topic("/shot", other), START_NS, START_NS, fired(START_NS, v=1))
    writer.close()
    assert "recorded with another definition" in complaint(writer.folder)


def test_a_bag_that_goes_away_while_it_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    bag = write_episode(episode(frames=3000), tmp_path)
    taken = _taking(lambda: shutil.rmtree(bag, ignore_errors=True))
    monkeypatch.setattr("compass_ros.episodes.reader.decode", taken)
    read_episode(bag, ALL)  # an open file outlives its name
    assert not bag.exists()
    assert "no such bag" in complaint(bag)


def _taking(act: Callable[[], None]) -> Callable[[RawMessage], object]:
    def decode_and_act(message: RawMessage) -> object:
        act()
        return decode(message)

    return decode_and_act


def test_list_topics_is_sorted_and_counts(bag: Path) -> None:
    topics = list_topics(bag)
    assert [topic.name for topic in topics] == sorted(topic.name for topic in topics)
    assert {topic.name: topic.messages for topic in topics}["/joint_states"] == 60
    assert np.all([topic.messages > 0 for topic in topics])

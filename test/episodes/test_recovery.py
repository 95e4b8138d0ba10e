"""Bags cut off anywhere become whole again: every message before the cut, none after it, and never a false claim."""

from __future__ import annotations

import fcntl
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import CompressionType, Writer
from rosbags.highlevel import AnyReader

from compass_ros.episodes import list_topics, read_episode, recover, unfinished, write_episode
from compass_ros.episodes.bag import RawMessage, scan
from compass_ros.episodes.definitions import EPISODE_TYPE, POSE_TYPE, embedded_definition, typestore
from compass_ros.episodes.notes import EPISODE_TOPIC, EpisodeHeader, header, header_bytes
from compass_ros.episodes.writer import BagWriter
from compass_ros.errors import BagError
from test.episodes.planted import PUCK1, START_NS, digest, episode, mcap_file, pose_bag, pose_bytes

FRAMES = 50


def cut_bag(folder: Path, frames: int = FRAMES) -> tuple[Path, list[int]]:
    """A bag as a killed recorder leaves it, and the file's size after each message."""
    writer = BagWriter(folder)
    episodes = writer.add_topic(EPISODE_TOPIC, embedded_definition(EPISODE_TYPE))
    poses = writer.add_topic(PUCK1[0].topic, embedded_definition(POSE_TYPE))
    writer.write(episodes, START_NS, START_NS, header_bytes(EpisodeHeader("recording", "e", "cell", start_ns=START_NS)))
    ends = [writer.path.stat().st_size]
    for frame in range(frames):
        stamp = START_NS + frame * 10**7
        writer.write(poses, stamp, stamp, pose_bytes(stamp, x=frame))
        ends.append(writer.path.stat().st_size)
    writer.abandon()
    return folder, ends


def test_every_message_is_in_the_file_when_write_returns(tmp_path: Path) -> None:
    _, ends = cut_bag(tmp_path / "bag")
    assert (np.diff(ends) > 300).all(), "nothing stays in this process"


@pytest.mark.parametrize("seed", range(25))
def test_cut_anywhere(tmp_path: Path, seed: int) -> None:
    bag, ends = cut_bag(tmp_path / "bag")
    cut = int(np.random.default_rng(seed).integers(ends[0], ends[-1] + 1))
    with mcap_file(bag).open("r+b") as file:
        file.truncate(cut)
    whole = sum(end <= cut for end in ends)  # the header of the episode, and poses
    with pytest.raises(BagError, match="--recover"):
        read_episode(bag, PUCK1)
    found = recover(bag)
    assert (found.messages, found.was_whole) == (whole + 1, False)  # and the header that says `recovered`
    if whole > 1:
        track = read_episode(bag, PUCK1, "cell").tracks[0]
        assert track.value[:, 0].tolist() == list(range(whole - 1))
    before = digest(bag)
    assert recover(bag).was_whole
    assert digest(bag) == before


@pytest.mark.parametrize("seed", range(10))
def test_cut_in_a_whole_bag(tmp_path: Path, seed: int) -> None:
    """Also with the end partly there: index, metadata record, footer."""
    bag = write_episode(episode(), tmp_path)
    (bag / "metadata.yaml").unlink()
    file = mcap_file(bag)
    size = file.stat().st_size
    cut = size - 1 - int(np.random.default_rng(seed).integers(4000))
    with file.open("r+b") as opened:
        opened.truncate(cut)
    kept = recover(bag).messages
    assert 273 - 12 <= kept <= 273
    assert sum(topic.messages for topic in list_topics(bag)) == kept


def test_rosbags_reads_a_recovered_bag(tmp_path: Path) -> None:
    bag, _ = cut_bag(tmp_path / "bag")
    recover(bag)
    with AnyReader([bag]) as reader:
        assert sum(1 for _ in reader.messages()) == reader.message_count == FRAMES + 2


def test_a_recovered_bag_says_so(tmp_path: Path) -> None:
    bag, _ = cut_bag(tmp_path / "bag")
    recover(bag)
    messages = [item for item in scan(bag) if isinstance(item, RawMessage) and item.topic.type == EPISODE_TYPE]
    headers = [header(typestore().deserialize_cdr(item.data, EPISODE_TYPE)) for item in messages]
    assert [found.state for found in headers] == ["recording", "recovered"]
    assert headers[1].messages == FRAMES + 1
    assert headers[1].duration_ns == (FRAMES - 1) * 10**7


def test_rubbish_after_the_cut_is_left_out(tmp_path: Path) -> None:
    """What a power cut can leave: blocks of zeros, or of another file."""
    for name, tail in (("zeros", bytes(4096)), ("noise", np.random.default_rng(0).bytes(4096))):
        bag, _ = cut_bag(tmp_path / name)
        with mcap_file(bag).open("ab") as file:
            file.write(tail)
        assert recover(bag).messages == FRAMES + 2


@pytest.mark.parametrize("compression", [CompressionType.NONE, CompressionType.LZ4, CompressionType.ZSTD])
def test_a_foreign_bag_with_chunks(tmp_path: Path, compression: CompressionType) -> None:
    """As `ros2 bag record -s mcap` leaves it when it is killed: whole chunks, then a piece of one."""
    folder = tmp_path / "foreign"
    folder.mkdir()
    definition = embedded_definition(POSE_TYPE)
    with (folder / "foreign_0.mcap").open("wb") as file:
        writer = Writer(file, chunk_size=4000, compression=compression)
        writer.start(profile="ros2", library="other")
        schema = writer.register_schema(POSE_TYPE, "ros2msg", definition.text.encode())
        channel = writer.register_channel("/pose", "cdr", schema)
        for frame in range(100):
            writer.add_message(channel, frame, pose_bytes(START_NS + frame, x=frame), frame)
        size = file.tell()
        file.truncate(size - 1)
    found = recover(folder)
    assert 50 < found.messages < 100
    assert [topic.messages for topic in list_topics(folder)] == [found.messages]


def test_nothing_to_recover(tmp_path: Path) -> None:
    with pytest.raises(BagError, match="no such bag"):
        recover(tmp_path / "nowhere")
    with pytest.raises(BagError, match=r"expected one \.mcap file"):
        recover(tmp_path)
    (tmp_path / "x.mcap").write_bytes(b"not a bag at all")
    with pytest.raises(BagError, match="holds no whole message"):
        recover(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["x.mcap"]


def test_a_bag_that_is_being_recorded_is_left_alone(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "bag")
    channel = writer.add_topic("/pose", embedded_definition(POSE_TYPE))
    writer.write(channel, 1, 1, pose_bytes(START_NS))
    with pytest.raises(BagError, match="is being recorded now"):
        recover(tmp_path / "bag")
    writer.write(channel, 2, 2, pose_bytes(START_NS + 1))
    writer.close()
    assert sum(topic.messages for topic in list_topics(tmp_path / "bag")) == 2


def test_an_interrupted_recovery_can_be_repeated(tmp_path: Path) -> None:
    """Killed in the middle it leaves its work folder; killed between its two renames, a whole file without metadata."""
    bag, _ = cut_bag(tmp_path / "bag")
    (bag / ".recovering_bag_0.mcap").mkdir()
    (bag / ".recovering_bag_0.mcap" / "bag_0.mcap").write_bytes(b"half")
    assert recover(bag).messages == FRAMES + 2
    (bag / "metadata.yaml").unlink()
    assert recover(bag).messages == FRAMES + 2
    assert sorted(path.name for path in bag.iterdir()) == ["bag_0.mcap", "metadata.yaml"]


def test_unfinished_bags_are_found(tmp_path: Path) -> None:
    cut, _ = cut_bag(tmp_path / "cut")
    pose_bag(tmp_path / "whole", [START_NS], [(0, 0)])
    (tmp_path / "file").write_text("")
    assert unfinished(tmp_path) == (cut,)


def test_the_lock_falls_with_the_writer(tmp_path: Path) -> None:
    bag, _ = cut_bag(tmp_path / "bag")
    with mcap_file(bag).open() as file:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)

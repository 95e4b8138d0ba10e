"""Bags cut off anywhere become whole again: every message before the cut, none after it, and never a false claim."""

from __future__ import annotations

import fcntl
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.records import Chunk, Message
from mcap.stream_reader import StreamReader, breakup_chunk
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


@pytest.mark.parametrize("seed", range(20))
def test_cut_in_a_whole_bag(tmp_path: Path, seed: int) -> None:
    """As a copy that was interrupted leaves it: in a chunk, in the index, in the metadata record, in the footer."""
    bag = write_episode(episode(), tmp_path)
    (bag / "metadata.yaml").unlink()
    file = mcap_file(bag)
    content = file.read_bytes()
    ends = [content.index(item.data) + len(item.data) for item in scan(file) if isinstance(item, RawMessage)]
    cut = int(np.random.default_rng(seed).integers(ends[0], len(content)))
    with file.open("r+b") as opened:
        opened.truncate(cut)
    kept = recover(bag).messages
    assert kept == sum(end <= cut for end in ends)
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
@pytest.mark.parametrize("share", [0.9, 0.6, 0.3])
def test_a_foreign_bag_with_chunks(tmp_path: Path, compression: CompressionType, share: float) -> None:
    """As a full disk, a copy or a power cut leaves one of `ros2 bag record`: whole chunks, then a piece of one."""
    folder = tmp_path / "foreign"
    folder.mkdir()
    path = folder / "foreign_0.mcap"
    definition = embedded_definition(POSE_TYPE)
    random = np.random.default_rng(0)
    sent = [pose_bytes(START_NS + frame, *random.normal(size=2)) for frame in range(400)]
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=50_000, compression=compression)
        writer.start(profile="ros2", library="other")
        schema = writer.register_schema(POSE_TYPE, "ros2msg", definition.text.encode())
        channel = writer.register_channel("/pose", "cdr", schema)
        for frame, data in enumerate(sent):
            writer.add_message(channel, frame, data, frame)
        writer.finish()  # type: ignore[no-untyped-call]
    content = path.read_bytes()
    cut = int(len(content) * share)
    opened = StreamReader(BytesIO(content), emit_chunks=True).records
    whole = sum(
        sum(isinstance(record, Message) for record in breakup_chunk(chunk))
        for chunk in opened
        if isinstance(chunk, Chunk) and content.index(chunk.data) + len(chunk.data) <= cut
    )
    if compression is CompressionType.NONE:
        whole = sum(content.index(data) + len(data) <= cut for data in sent)
    path.write_bytes(content[:cut])
    found = recover(folder)
    stored = [item.data for item in scan(folder) if isinstance(item, RawMessage)]
    assert stored == sent[: found.messages]
    assert found.messages >= whole > 0
    assert found.messages == whole or compression is not CompressionType.NONE


@pytest.mark.parametrize("encoding", ["cdr", "ros1"])
def test_the_encoding_of_messages_stays(tmp_path: Path, encoding: str) -> None:
    folder = tmp_path / "foreign"
    folder.mkdir()
    with (folder / "foreign_0.mcap").open("wb") as file:
        writer = Writer(file, use_chunking=False)
        writer.start()
        schema = writer.register_schema("std_msgs/String", "ros1msg", b"string data")
        writer.add_message(writer.register_channel("/said", encoding, schema), 1, b"\0\0\0\0", 1)
    recover(folder)
    with mcap_file(folder).open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    assert [channel.message_encoding for channel in summary.channels.values()] == [encoding]
    assert f"serialization_format: {encoding}\n" in (folder / "metadata.yaml").read_text()


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

"""The same recording in other people's formats gives the same tracks."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
import zstandard
from mcap.writer import CompressionType, Writer
from rosbags.rosbag2 import CompressionMode, StoragePlugin

from compass_ros.episodes import Source, find_bags, list_topics, read_bag, read_episode
from compass_ros.episodes.definitions import POSE_TYPE, embedded_definition
from compass_ros.errors import BagError
from compass_ros.operation.current import held_out_bags
from test.episodes.foreign import FORMATS, FRAMES, POSITION, SOURCES, STAMPS, TURN, all_bags, write_ros1, write_rosbag2
from test.episodes.planted import pose_bytes


class Usage(NamedTuple):
    """As shutil.disk_usage gives it."""

    total: int
    used: int
    free: int


@pytest.fixture(scope="module")
def bags(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    return list(all_bags(tmp_path_factory.mktemp("foreign")))


@pytest.mark.parametrize("index", range(len(FORMATS)), ids=FORMATS)
def test_every_message_type_in_every_format(bags: list[Path], index: int) -> None:
    content = read_bag(bags[index], SOURCES, cell="theirs")
    found = content.episode
    assert (found.cell, found.cell_hash, found.start_ns, dict(found.action)) == ("theirs", "", STAMPS[0], {})
    for track in found.tracks:
        assert track.stamp_ns.tolist() == STAMPS
    for name in ("a", "d"):
        np.testing.assert_array_equal(found.track(name).value, np.hstack([POSITION, np.tile(TURN, (FRAMES, 1))]))
    for name in ("c", "e"):
        np.testing.assert_array_equal(found.track(name).value, POSITION)
    for name in ("b", "f"):
        np.testing.assert_array_equal(found.track(name).value, POSITION[:, :2])
        np.testing.assert_allclose(np.asarray(found.track(name).std), 2e-3)
    np.testing.assert_array_equal(found.track("g").value, POSITION[:, :1])
    assert [topic.name for topic in content.topics if not topic.known] == ["/text"]


def test_all_formats_list_the_same_topics(bags: list[Path]) -> None:
    lists = [list_topics(bag) for bag in bags]
    assert all(found == lists[0] for found in lists)
    assert [topic.messages for topic in lists[0]] == [FRAMES] * 8


def test_bags_are_found_in_a_folder(bags: list[Path]) -> None:
    assert sorted(find_bags([bags[0].parent])) == sorted(bags)


@pytest.mark.parametrize(
    ("path", "name"),
    [
        ("toss.1/toss.1.mcap", "toss.1"),
        ("投げ/投げ_0.mcap", "投げ"),
        ("toss.1.mcap", "toss.1"),
        ("2024-05-01.12.mcap.zstd", "2024-05-01.12"),
        ("a b.db3", "a b"),
    ],
)
def test_recordings_are_called_as_their_files(tmp_path: Path, path: str, name: str) -> None:
    """A point in a name is no ending: `toss.1` and `toss.2` are two episodes."""
    storage = StoragePlugin.SQLITE3 if path.endswith("db3") else StoragePlugin.MCAP
    compression = CompressionMode.FILE if path.endswith("zstd") else CompressionMode.NONE
    (file,) = (
        f for f in write_rosbag2(tmp_path / "made", storage, range(3), compression).iterdir() if f.suffix != ".yaml"
    )
    target = tmp_path / path
    target.parent.mkdir(exist_ok=True)
    file.rename(target)
    bag = target.parent if "/" in path else target
    assert read_episode(bag, SOURCES).name == name
    assert held_out_bags([str(bag)], [name]) == (bag,)


def test_a_frame_that_is_not_there(bags: list[Path]) -> None:
    for bag in bags:
        with pytest.raises(BagError, match=r"no messages of 'third' on /tf .*there are .*second"):
            read_episode(bag, [Source("/tf", "e", "xyz", entry="third")])


def test_a_point_has_no_orientation(bags: list[Path]) -> None:
    with pytest.raises(BagError, match="a geometry_msgs/msg/PointStamped holds no 'pose' of c"):
        read_episode(bags[0], [Source("/point", "c", "pose")])


@pytest.mark.parametrize("compression", [CompressionType.LZ4, CompressionType.ZSTD, CompressionType.NONE])
def test_a_bare_mcap_file_with_chunks(tmp_path: Path, compression: CompressionType) -> None:
    path = tmp_path / "theirs.mcap"
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=3000, compression=compression)
        writer.start(profile="ros2", library="other")
        schema = writer.register_schema(POSE_TYPE, "ros2msg", embedded_definition(POSE_TYPE).text.encode())
        channel = writer.register_channel("/pose", "cdr", schema)
        for frame in range(100):
            writer.add_message(channel, frame, pose_bytes(STAMPS[0] + frame, x=frame), frame)
        writer.finish()  # type: ignore[no-untyped-call]
    found = read_episode(path, [Source("/pose", "a")])
    assert found.tracks[0].value[:, 0].tolist() == list(range(100))


@pytest.mark.parametrize(
    "name", ["geometry_msgs/msg/PoseWithCovarianceStamped", "geometry_msgs/PoseWithCovarianceStamped"]
)
@pytest.mark.parametrize(("profile", "encoding"), [("ros2", "ros2msg"), ("", "ros2idl"), ("x", "")])
def test_mcap_of_other_writers(tmp_path: Path, name: str, profile: str, encoding: str) -> None:
    """Neither the profile nor how the definition is written decides: the messages are CDR of a type that is known."""
    path = tmp_path / "theirs.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile=profile, library="other")
        channel = writer.register_channel("/pose", "cdr", writer.register_schema(name, encoding, b""))
        for frame in range(5):
            writer.add_message(channel, frame, pose_bytes(STAMPS[0] + frame, x=frame), frame)
        writer.finish()  # type: ignore[no-untyped-call]
    assert read_episode(path, [Source("/pose", "a")]).tracks[0].value[:, 0].tolist() == [0, 1, 2, 3, 4]


@pytest.mark.parametrize("encoding", ["json", "protobuf", "flatbuffer", "msgpack", ""])
def test_messages_that_are_not_of_ros(tmp_path: Path, encoding: str) -> None:
    path = tmp_path / "theirs.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        channel = writer.register_channel("/pose", encoding, writer.register_schema(POSE_TYPE, "", b""))
        writer.add_message(channel, 1, b"{}", 1)
        writer.finish()  # type: ignore[no-untyped-call]
    said = rf"/pose is a {POSE_TYPE} \({encoding or 'in no encoding'}\); expected one of"
    with pytest.raises(BagError, match=said):
        read_episode(path, [Source("/pose", "a")])
    assert [topic.known for topic in list_topics(path)] == [False]


@pytest.mark.parametrize("ending", [".zstd", ".zst"])
@pytest.mark.parametrize("storage", [StoragePlugin.MCAP, StoragePlugin.SQLITE3])
def test_files_that_somebody_packed(tmp_path: Path, storage: StoragePlugin, ending: str) -> None:
    """With the command `zstd`, in two frames; in the folder of their bag and outside."""
    bag = write_rosbag2(tmp_path / "bag", storage)
    (file,) = bag.glob("bag.*")
    content, half = file.read_bytes(), file.stat().st_size // 2
    packed = zstandard.compress(content[:half]) + zstandard.compress(content[half:])
    file.unlink()
    for path in (bag / (file.name + ending), tmp_path / (file.name + ending)):
        path.write_bytes(packed)
        np.testing.assert_array_equal(read_episode(path, SOURCES[2:3]).tracks[0].value, POSITION)
    np.testing.assert_array_equal(read_episode(bag, SOURCES[2:3]).tracks[0].value, POSITION)
    assert len(find_bags([tmp_path])) == 2


@pytest.mark.parametrize(
    ("damage", "said"),
    [
        (lambda packed: packed[:-20], "truncated: packed with zstd"),
        (lambda packed: b"", "truncated: packed with zstd"),
        (lambda packed: b"x" + packed, "not packed with zstd, or damaged"),
        (lambda packed: packed[:30] + bytes(40) + packed[70:], "not packed with zstd, or damaged|damaged:|truncated"),
        (lambda packed: zstandard.compress(zstandard.decompress(packed)[:-100]), "truncated, the file has no end"),
    ],
)
def test_packed_files_that_are_damaged(tmp_path: Path, damage: Callable[[bytes], bytes], said: str) -> None:
    file = write_rosbag2(tmp_path / "bag", StoragePlugin.MCAP) / "bag.mcap"
    path = tmp_path / "bag.mcap.zstd"
    path.write_bytes(damage(zstandard.compress(file.read_bytes())))
    with pytest.raises(BagError, match=said):
        read_episode(path, SOURCES)


def test_a_small_file_that_unpacks_to_very_much(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "bomb.mcap.zstd"
    path.write_bytes(zstandard.compress(bytes(2**28)))
    monkeypatch.setattr("shutil.disk_usage", lambda folder: Usage(0, 0, 2**27))
    with pytest.raises(BagError, match="does not unpack into half of what is free"):
        read_episode(path, SOURCES)


def test_a_message_that_unpacks_to_very_much(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("compass_ros.episodes.packed.LARGEST_MESSAGE", 200)
    bag = write_rosbag2(tmp_path / "bag", StoragePlugin.MCAP, compression=CompressionMode.MESSAGE)
    with pytest.raises(BagError, match="a message unpacks to more than 200 bytes"):
        read_episode(bag, SOURCES)


@pytest.mark.parametrize("share", [0.1, 0.5, 0.95, 0.999])
def test_ros1_bags_cut_off(tmp_path: Path, share: float) -> None:
    path = write_ros1(tmp_path / "x.bag")
    path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    with pytest.raises(BagError, match=r"x\.bag: not a readable ROS 1 bag"):
        read_episode(path, SOURCES)


def test_a_ros1_bag_without_its_index_says_what_gives_it_one(tmp_path: Path) -> None:
    path = write_ros1(tmp_path / "x.bag")
    content = bytearray(path.read_bytes())
    at = content.index(b"index_pos=") + len(b"index_pos=")
    content[at : at + 8] = bytes(8)
    path.write_bytes(content)
    with pytest.raises(BagError, match=r"x\.bag: not a readable ROS 1 bag: .*not indexed.*rosbag reindex"):
        read_episode(path, SOURCES)


def test_a_database_that_is_none(tmp_path: Path) -> None:
    for name, content in (("empty.db3", b""), ("text.db3", b"hello, this is no database" * 100)):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(BagError, match=rf"{name}: not a (readable )?rosbag2 database"):
            read_episode(tmp_path / name, SOURCES)


ENDLESS_ROWS = """
CREATE VIEW messages AS WITH RECURSIVE c(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM c)
SELECT 1 AS topic_id, x AS timestamp, zeroblob(10) AS data FROM c
"""
ENDLESS_BLOB = """
CREATE TABLE messages(id INTEGER, topic_id INTEGER, timestamp INTEGER,
                      data BLOB GENERATED ALWAYS AS (zeroblob(1000000000)) VIRTUAL);
INSERT INTO messages(id, topic_id, timestamp) VALUES (1, 1, 1)
"""


@pytest.mark.parametrize("trap", [ENDLESS_ROWS, ENDLESS_BLOB], ids=["rows", "blob"])
def test_a_database_that_computes_is_refused(tmp_path: Path, trap: str) -> None:
    path = tmp_path / "trap.db3"
    database = sqlite3.connect(path)
    database.executescript(f"CREATE TABLE topics(id INTEGER, name TEXT, type TEXT); {trap}")
    database.close()
    with pytest.raises(BagError, match="expected a table 'messages'"):
        read_episode(path, SOURCES)


def test_a_split_recording_is_read_as_one(tmp_path: Path) -> None:
    """metadata.yaml may name several files."""
    bag = write_rosbag2(tmp_path / "split", StoragePlugin.SQLITE3)
    other = write_rosbag2(tmp_path / "other", StoragePlugin.SQLITE3)
    (other / "other.db3").rename(bag / "second.db3")
    text = (bag / "metadata.yaml").read_text()
    text = text.replace("relative_file_paths:\n  - split.db3", "relative_file_paths:\n  - split.db3\n  - second.db3")
    (bag / "metadata.yaml").write_text(text.replace("message_count: 160", "message_count: 320"))
    assert [topic.messages for topic in list_topics(bag)] == [2 * FRAMES] * 8

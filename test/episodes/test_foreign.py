"""The same recording in other people's formats gives the same tracks."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import CompressionType, Writer
from rosbags.rosbag2 import StoragePlugin

from compass_ros.episodes import Source, find_bags, list_topics, read_bag, read_episode
from compass_ros.episodes.definitions import POSE_TYPE, embedded_definition
from compass_ros.errors import BagError
from test.episodes.foreign import FRAMES, POSITION, SOURCES, STAMPS, TURN, all_bags, write_ros1, write_rosbag2
from test.episodes.planted import pose_bytes


@pytest.fixture(scope="module")
def bags(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    return list(all_bags(tmp_path_factory.mktemp("foreign")))


@pytest.mark.parametrize("index", range(5), ids=["mcap", "sqlite3", "ros1", "ros1-bz2", "ros1-lz4"])
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


@pytest.mark.parametrize("share", [0.1, 0.5, 0.95, 0.999])
def test_ros1_bags_cut_off(tmp_path: Path, share: float) -> None:
    path = write_ros1(tmp_path / "x.bag")
    path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    with pytest.raises(BagError, match=r"x\.bag: not a readable ROS 1 bag"):
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

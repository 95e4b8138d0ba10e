"""Readers that we did not write find every message of every kind of bag, by the index, with the same bytes.

Foxglove's (`@mcap/core`), mcap's, Rerun's, rosbags', and the metadata record as rosbag2 decodes it. `make readers`
installs the two that are not in `.venv`.
"""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import SeekingReader
from mcap.records import Channel, Message
from mcap.stream_reader import StreamReader
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import StoragePlugin

from compass_ros.episodes import recover, reindex, write_episode
from compass_ros.episodes.definitions import POSE_TYPE, STRING_TYPE, embedded_definition
from compass_ros.episodes.recording import Connection, Recorder
from compass_ros.episodes.rolling import Rolling
from test.episodes.foreign import write_rosbag2
from test.episodes.planted import PUCK1, START_NS, episode, mcap_file, pose_bytes
from test.episodes.test_latched import text
from test.episodes.test_reindex import old_bag
from test.readers import rosbag2


@dataclass(frozen=True)
class Reader:
    """One that runs in a process of its own: its command, before the files, and what must have been installed."""

    words: tuple[str, ...]
    installed: Path


ROOT = Path(__file__).parents[2]
HERE = Path(__file__).parent
NODE = Reader(("node", str(HERE / "indexed.mjs")), HERE / "node_modules")
RERUN = Reader((str(ROOT / ".venv-rerun/bin/python"), str(HERE / "rerun_rows.py")), ROOT / ".venv-rerun")
Found = tuple[str, int, str]
"""Topic, log time [ns], SHA-256 of the data."""


def digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def recorded(folder: Path, stop: bool) -> tuple[Path, list[Found]]:
    """A recording of several chunks; its bag, and what was sent. A latched message came before it.

    Its last 2 s are in the bag `last_0001` beside it.
    """
    recorder = Recorder(folder, rolling=Rolling(2 * 10**9, 10**9))
    for topic, kind, latched in (
        ("/robot_description", STRING_TYPE, 1),
        (PUCK1[0].topic, POSE_TYPE, 0),
        ("/large", STRING_TYPE, 0),
        ("/silent", STRING_TYPE, 0),
    ):
        recorder.connect(Connection(topic, embedded_definition(kind), latched=latched))
    recorder.take("/robot_description", text("<robot/>"), START_NS - 1, START_NS - 1)
    sent = [("/robot_description", START_NS, text("<robot/>"))]
    random = np.random.default_rng(0)
    bag = recorder.start("", "cell", "a1", {"v": 1.0}, START_NS).bag
    for number in range(3000):
        at_ns = START_NS + number * 2_000_000
        sent.append((PUCK1[0].topic, at_ns, pose_bytes(at_ns, x=number)))
        if number % 100 == 0:
            sent.append(("/large", at_ns, text(random.bytes(75_000).hex())))
    for topic, at_ns, data in sent[1:]:
        recorder.take(topic, data, at_ns, at_ns - 1)
    last, past = recorder.last(sent[-1][1])
    past.write(last, "cell", "a1")
    if stop:
        recorder.stop()
    recorder.close()
    return Path(bag), [(topic, at_ns, digest(data)) for topic, at_ns, data in sent]


def cut_in_a_chunk(bag: Path) -> Path:
    """As a copy leaves it that was interrupted."""
    (bag / "metadata.yaml").unlink()
    os.truncate(mcap_file(bag), mcap_file(bag).stat().st_size // 2)
    recover(bag)
    return bag


@pytest.fixture(scope="module")
def bags(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A bag of each kind that this suite writes."""
    folder = tmp_path_factory.mktemp("bags")
    killed, _ = recorded(folder / "killed", stop=False)
    recover(killed)
    reindexed = old_bag(folder / "old")
    reindex(reindexed)
    return {
        "finished": recorded(folder / "finished", stop=True)[0],
        "saved afterwards": folder / "finished" / "last_0001",
        "recovered": killed,
        "recovered in a chunk": cut_in_a_chunk(recorded(folder / "cut", stop=True)[0]),
        "imported": write_episode(episode(), folder),
        "reindexed": reindexed,
        **{path.parent.name: path.parent for path in sorted(ROOT.glob("bags/*/metadata.yaml"))},
        **{path.parent.name: path.parent for path in sorted(ROOT.glob("examples/*/bags/*/metadata.yaml"))},
    }


def front_to_back(bag: Path) -> list[Found]:
    """The messages as they stand in the file, without any index."""
    topics: dict[int, str] = {}
    found = []
    with mcap_file(bag).open("rb") as file:
        for record in StreamReader(file, validate_crcs=True).records:
            if isinstance(record, Channel):
                topics[record.id] = record.topic
            elif isinstance(record, Message):
                found.append((topics[record.channel_id], record.log_time, digest(record.data)))
    return found


def read(reader: Reader, bags: dict[str, Path]) -> list[dict[str, Any]]:
    """What a reader prints of each bag."""
    assert reader.installed.exists(), "run: make readers"
    files = [str(mcap_file(bag)) for bag in bags.values()]
    done = subprocess.run([*reader.words, *files], check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]


def messages(said: dict[str, Any]) -> list[Found]:
    return sorted((topic, int(time), found) for topic, time, found in said["messages"])


def test_what_was_sent_is_in_the_file(tmp_path: Path) -> None:
    bag, sent = recorded(tmp_path, stop=True)
    stored = front_to_back(bag)
    assert [found for found in stored if not found[0].startswith("/compass")] == sent
    assert len(stored) == len(sent) + 3  # two headers, one shot


def test_foxglove(bags: dict[str, Path]) -> None:
    said = read(NODE, bags)
    for (name, bag), found in zip(bags.items(), said, strict=True):
        expected = front_to_back(bag)
        assert messages(found) == sorted(expected), name
        middle = (expected[0][1] + expected[-1][1]) // 2
        for topic, count in found["late"].items():
            assert count == sum(one[0] == topic and one[1] >= middle for one in expected), (name, topic)


def test_rerun(bags: dict[str, Path]) -> None:
    said = read(RERUN, bags)
    for (name, bag), found in zip(bags.items(), said, strict=True):
        expected = front_to_back(bag)
        assert messages(found) == sorted(expected), name
        assert found["rows"] >= len(expected), name  # a JointState makes several


def test_mcaps_indexed_reader(bags: dict[str, Path]) -> None:
    for name, bag in bags.items():
        with mcap_file(bag).open("rb") as file:
            reader = SeekingReader(file, validate_crcs=True)
            found = [(channel.topic, one.log_time, digest(one.data)) for _, channel, one in reader.iter_messages()]
            summary = reader.get_summary()
        expected = front_to_back(bag)
        assert sorted(found) == sorted(expected), name
        assert summary is not None
        assert summary.statistics is not None
        assert summary.statistics.message_count == len(expected), name
        assert sum(summary.statistics.channel_message_counts.values()) == len(expected), name


def test_rosbags(bags: dict[str, Path]) -> None:
    for name, bag in bags.items():
        with AnyReader([bag]) as reader:
            found = [(connection.topic, at_ns, digest(data)) for connection, at_ns, data in reader.messages()]
        assert sorted(found) == sorted(front_to_back(bag)), name


def record(bag: Path) -> str:
    with mcap_file(bag).open("rb") as file:
        (found,) = (one for one in SeekingReader(file).iter_metadata() if one.name == "rosbag2")
    return found.metadata["serialized_metadata"]


def test_rosbag2_decodes_the_metadata_record(bags: dict[str, Path]) -> None:
    for name, bag in bags.items():
        found = rosbag2.decode(record(bag))
        expected = front_to_back(bag)
        assert found.messages == len(expected), name
        assert found.files == (mcap_file(bag).name,), name
        counts = {topic: count for topic, (_, count) in found.topics.items() if count}
        assert counts == {topic: [one[0] for one in expected].count(topic) for topic in {one[0] for one in expected}}


def test_the_decoder_takes_what_others_write_and_refuses_what_rosbag2_refuses(tmp_path: Path) -> None:
    """Another writer of the format, rosbags; and version 0.1 of this suite, which kept the key of metadata.yaml."""
    assert rosbag2.decode(record(write_rosbag2(tmp_path / "theirs", StoragePlugin.MCAP))).messages > 0
    with pytest.raises(KeyError, match="version"):
        rosbag2.decode(record(old_bag(tmp_path / "old")))


@pytest.mark.parametrize(("kind", "chunks"), [("finished", 6), ("recovered", 6), ("imported", 1)])
def test_a_file_is_of_the_usual_kind(bags: dict[str, Path], kind: str, chunks: int) -> None:
    """Chunks of about 1 MiB that do not overlap in time, each with the index of its messages."""
    with mcap_file(bags[kind]).open("rb") as file:
        summary = SeekingReader(file).get_summary()
    assert summary is not None
    times = [(one.message_start_time, one.message_end_time) for one in summary.chunk_indexes]
    assert len(times) == chunks
    assert all(one[1] <= other[0] for one, other in pairwise(times))
    assert all(one.message_index_length and one.uncompressed_size < 1.3 * 2**20 for one in summary.chunk_indexes)

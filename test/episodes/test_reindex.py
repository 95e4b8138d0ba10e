"""Bags of version 0.1, without chunks, without index, with a metadata record that rosbag2 refuses, are written anew."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml
from mcap.reader import SeekingReader
from mcap.records import Message
from mcap.writer import CompressionType, IndexType, Writer

from compass_ros.episodes import mcap_stream, read_episode, recover, reindex, write_episode
from compass_ros.episodes.definitions import EPISODE_TYPE, POSE_TYPE, SHOT_TYPE, embedded_definition
from compass_ros.episodes.notes import EPISODE_TOPIC, EpisodeHeader, Shot, header_bytes, shot_bytes
from compass_ros.errors import BagError
from test.conftest import Run
from test.episodes.planted import PUCK1, START_NS, digest, episode, mcap_file, pose_bytes

OLD = {EPISODE_TYPE: "compass_interfaces/msg/EpisodeInfo", SHOT_TYPE: "compass_interfaces/msg/ShotCommand"}
TOPICS = {EPISODE_TOPIC: EPISODE_TYPE, "/robot/shot": SHOT_TYPE, PUCK1[0].topic: POSE_TYPE}


def old_bag(folder: Path, frames: int = 40, metadata_key: bool = True, chunks: bool = False) -> Path:
    """As version 0.1 recorded it."""
    folder.mkdir()
    messages = [
        (EPISODE_TOPIC, header_bytes(EpisodeHeader("recording", "e", "cell", "a1", START_NS))),
        ("/robot/shot", shot_bytes(Shot(START_NS, "cell", {"v": 1.5}))),
        *((PUCK1[0].topic, pose_bytes(START_NS + frame, x=frame)) for frame in range(frames)),
        (EPISODE_TOPIC, header_bytes(EpisodeHeader("finished", "e", "cell", "a1", START_NS))),
    ]
    counts = {topic: sum(name == topic for name, _ in messages) for topic in TOPICS}
    information = {
        "version": 9,
        "storage_identifier": "mcap",
        "relative_file_paths": [f"{folder.name}_0.mcap"],
        "starting_time": {"nanoseconds_since_epoch": START_NS},
        "duration": {"nanoseconds": len(messages) - 1},
        "message_count": len(messages),
        "topics_with_message_count": [
            {"topic_metadata": {"name": topic, "type": OLD.get(kind, kind)}, "message_count": counts[topic]}
            for topic, kind in TOPICS.items()
        ],
    }
    whole = yaml.safe_dump({"rosbag2_bagfile_information": information})
    (folder / "metadata.yaml").write_text(whole)
    with (folder / f"{folder.name}_0.mcap").open("wb") as file:
        kinds = IndexType.ALL if chunks else IndexType.METADATA
        mcap = Writer(file, compression=CompressionType.NONE, index_types=kinds, use_chunking=chunks)
        mcap.start("ros2", "compass_ros")
        channels = {}
        for topic, kind in TOPICS.items():
            definition = embedded_definition(OLD.get(kind, kind))
            schema = mcap.register_schema(definition.type, definition.encoding, definition.text.encode())
            said = {"offered_qos_profiles": "", "topic_type_hash": definition.digest}
            channels[topic] = mcap.register_channel(topic, "cdr", schema, said)
        for number, (topic, data) in enumerate(messages):
            mcap.add_message(channels[topic], START_NS + number, data, START_NS - number, number)
        record = whole if metadata_key else yaml.safe_dump(information)
        mcap.add_metadata("rosbag2", {"serialized_metadata": record})
        mcap.finish()  # type: ignore[no-untyped-call]
    return folder


def messages_of(bag: Path) -> list[tuple[int, int, bytes]]:
    found = mcap_stream.records(mcap_file(bag))
    return [(one.log_time, one.publish_time, one.data) for one in found if isinstance(one, Message)]


@pytest.mark.parametrize(("metadata_key", "chunks"), [(True, False), (True, True), (False, False)])
def test_the_same_messages_with_an_index(tmp_path: Path, metadata_key: bool, chunks: bool) -> None:
    bag = old_bag(tmp_path / "bag", metadata_key=metadata_key, chunks=chunks)
    before, messages = read_episode(bag, PUCK1, "cell", "a1"), messages_of(bag)
    assert not reindex(bag).was_whole
    after = read_episode(bag, PUCK1, "cell", "a1")
    assert messages_of(bag) == messages
    assert (after.action, after.start_ns) == (before.action, before.start_ns) == ({"v": 1.5}, START_NS)
    assert after.tracks[0].value.tolist() == before.tracks[0].value.tolist()
    with mcap_file(bag).open("rb") as file:
        summary = SeekingReader(file).get_summary()
        assert summary is not None
        assert summary.chunk_indexes
        assert {schema.name for schema in summary.schemas.values()} == set(TOPICS.values())
        (record,) = SeekingReader(file).iter_metadata()
    assert yaml.safe_load(record.metadata["serialized_metadata"])["message_count"] == len(messages)


def test_what_has_an_index_is_left_alone(tmp_path: Path) -> None:
    new = write_episode(episode(), tmp_path)
    old = old_bag(tmp_path / "old", metadata_key=False, chunks=True)
    for bag in (new, old):
        before = digest(bag)
        assert reindex(bag).was_whole
        assert digest(bag) == before


def test_a_bag_that_was_cut_off_is_recovered_and_not_indexed(tmp_path: Path) -> None:
    bag = old_bag(tmp_path / "bag")
    with mcap_file(bag).open("r+b") as file:
        file.truncate(mcap_file(bag).stat().st_size // 2)
    with pytest.raises(BagError, match="--recover"):
        reindex(bag)
    kept = recover(bag).messages
    with mcap_file(bag).open("rb") as file:
        summary = SeekingReader(file).get_summary()
    assert summary is not None
    assert len(summary.channels) == len(TOPICS), "messages of this package under one name"
    assert reindex(bag).messages == kept


def test_the_command(tmp_path: Path, run: Run) -> None:
    bags = tmp_path / "bags"
    bags.mkdir()
    old_bag(bags / "one")
    write_episode(episode("two"), bags)
    status, out, _ = run("record", "--reindex", bags)
    assert (status, out) == (0, f"{bags}/one: indexed, 43 messages\n{bags}/two: has its index\n")

"""Any bag as a stream of raw messages: rosbag2 (MCAP, sqlite3) and ROS 1, whole or refused with one line."""

from __future__ import annotations

import sqlite3
import struct
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from mcap.records import Channel, Message, Schema
from rosbags.serde import SerdeError

from compass_ros.episodes import mcap_stream, metadata, ros1_bag
from compass_ros.episodes.definitions import embedded_definition, ros1_typestore, typestore
from compass_ros.errors import BagError

LARGEST_MESSAGE = 256 * 2**20


@dataclass(frozen=True)
class RawTopic:
    """A topic of a bag."""

    name: str
    type: str
    """`package/msg/Name`, also for ROS 1."""
    digest: str = ""
    """Type hash (ROS 1: md5 sum); empty where the bag does not say."""
    ros1: bool = False


@dataclass(frozen=True)
class RawMessage:
    topic: RawTopic
    log_ns: int
    data: bytes


def is_bag(path: Path) -> bool:
    """Whether a path looks like a bag, whole or not: a .mcap, .db3 or .bag file, or a rosbag2 folder.

    A folder without metadata.yaml counts where a file in it is named after it, as the files of a cut-off bag are.
    """
    if path.is_dir():
        return (path / metadata.FILE_NAME).exists() or bool(_storage_files(path))
    return path.suffix in _READERS


def scan(path: Path) -> Iterator[RawTopic | RawMessage]:
    """All topics and messages of a bag, in the order of the file; a topic comes before its messages.

    Raises BagError (also in the middle): missing, empty, truncated, not a bag, or fewer messages than its
    metadata says.
    """
    if path.is_dir():
        yield from _scan_folder(path)
    elif not path.exists():
        raise BagError(f"{path}: no such bag")
    elif path.suffix in _READERS:
        yield from _READERS[path.suffix](path)
    else:
        raise BagError(f"{path}: expected a bag: a folder with metadata.yaml, or a file .mcap, .db3 or .bag")


def decode(message: RawMessage) -> object:
    """Deserialise a message of a type that this package knows. Raises BagError where bytes or definition do not fit."""
    topic = message.topic
    if topic.digest and topic.digest != known_digest(topic):
        raise BagError(f"{topic.name}: {topic.type} was recorded with another definition than this version reads")
    try:
        if topic.ros1:
            return ros1_typestore().deserialize_ros1(message.data, topic.type)
        return typestore().deserialize_cdr(message.data, topic.type)
    except SerdeError as error:
        raise BagError(f"{topic.name}: a message is not a {topic.type}: {error}") from error
    except (IndexError, OverflowError, MemoryError) as error:
        raise BagError(f"{topic.name}: a message is not a {topic.type}: {type(error).__name__}") from error


def known_digest(topic: RawTopic) -> str:
    """Digest of the definition of a topic's type that this package reads."""
    if topic.ros1:
        return ros1_typestore().generate_msgdef(topic.type)[1]
    return embedded_definition(topic.type).digest


def _storage_files(folder: Path) -> list[Path]:
    return sorted(
        file for file in folder.glob("*") if file.suffix in (".mcap", ".db3") and file.stem.startswith(folder.name)
    )


def _scan_folder(folder: Path) -> Iterator[RawTopic | RawMessage]:
    if not (folder / metadata.FILE_NAME).exists():
        if _storage_files(folder):
            raise BagError(f"{folder}: truncated, it has no metadata.yaml; run: compass record --recover {folder}")
        raise BagError(f"{folder}: expected a bag, found a folder without metadata.yaml and without messages")
    summary = metadata.read_summary(folder)
    if summary.compression:
        raise BagError(f"{folder}: compressed by {summary.compression}; expected plain storage (`ros2 bag convert`)")
    suffix = {"mcap": ".mcap", "sqlite3": ".db3"}.get(summary.storage)
    if suffix is None:
        raise BagError(f"{folder}: storage '{summary.storage}' cannot be read; expected mcap or sqlite3")
    if not summary.messages:
        raise BagError(f"{folder}: empty, it holds no messages")
    digests = {(topic.name, topic.type): topic.digest for topic in summary.topics}
    found = 0
    for name in summary.files:
        if not (folder / name).exists():
            raise BagError(f"{folder}: metadata.yaml names {name}, which is missing")
        for item in _READERS[suffix](folder / name):
            topic = item if isinstance(item, RawTopic) else item.topic
            full = RawTopic(topic.name, topic.type, topic.digest or digests.get((topic.name, topic.type), ""))
            found += isinstance(item, RawMessage)
            yield full if isinstance(item, RawTopic) else RawMessage(full, item.log_ns, item.data)
    if found != summary.messages:
        raise BagError(f"{folder}: damaged: metadata.yaml says {summary.messages} messages, the files hold {found}")


def _scan_mcap(path: Path) -> Iterator[RawTopic | RawMessage]:
    try:
        if not mcap_stream.begins(path):
            raise BagError(f"{path}: expected MCAP, found a file that does not begin as one")
        if not mcap_stream.is_whole(path):
            folder = path.parent if (path.parent / metadata.FILE_NAME).exists() else path
            raise BagError(f"{path}: truncated, the file has no end; run: compass record --recover {folder}")
        yield from _mcap_messages(path)
    except OSError as error:
        raise BagError(f"{path}: cannot be read: {error.strerror}") from error
    except mcap_stream.BROKEN as error:
        raise BagError(f"{path}: damaged: {' '.join(str(error).split()) or type(error).__name__}") from error


def _mcap_messages(path: Path) -> Iterator[RawTopic | RawMessage]:
    schemas: dict[int, Schema] = {}
    topics: dict[int, RawTopic] = {}
    for record in mcap_stream.records(path):
        if isinstance(record, Schema):
            schemas[record.id] = record
        elif isinstance(record, Channel) and record.id not in topics:
            schema = schemas.get(record.schema_id)
            kind = schema.name if schema is not None else f"unknown ({record.message_encoding})"
            topics[record.id] = RawTopic(record.topic, kind, record.metadata.get("topic_type_hash", ""))
            yield topics[record.id]
        elif isinstance(record, Message):
            if record.channel_id not in topics:
                raise BagError(f"{path}: damaged: a message on channel {record.channel_id}, which was never declared")
            yield RawMessage(topics[record.channel_id], record.log_time, record.data)


def _scan_sqlite3(path: Path) -> Iterator[RawTopic | RawMessage]:
    try:
        with closing(sqlite3.connect(f"{path.absolute().as_uri()}?immutable=1", uri=True)) as database:
            yield from _sqlite3_messages(path, database)
    except (sqlite3.Error, ValueError, OverflowError, MemoryError) as error:
        raise BagError(f"{path}: not a readable rosbag2 database: {error}") from error


def _sqlite3_messages(path: Path, database: sqlite3.Connection) -> Iterator[RawTopic | RawMessage]:
    database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, min(LARGEST_MESSAGE, path.stat().st_size))
    columns = {"topics": {"id", "name", "type"}, "messages": {"topic_id", "timestamp", "data"}}
    for table, expected in columns.items():
        # hidden = 0: stored columns of real tables only, so nothing is computed while we read
        stored = {row[1] for row in database.execute(f"PRAGMA table_xinfo({table})") if row[6] == 0}
        kind = database.execute("SELECT type FROM sqlite_master WHERE name = ?", (table,)).fetchall()
        if kind != [("table",)] or not expected <= stored:
            raise BagError(f"{path}: not a rosbag2 database: expected a table '{table}' with {sorted(expected)}")
    topics = {}
    for key, name, kind in database.execute("SELECT id, name, type FROM topics ORDER BY id"):
        topics[key] = RawTopic(str(name), str(kind))
        yield topics[key]
    rows_left = path.stat().st_size // 8
    for key, log_ns, data in database.execute("SELECT topic_id, timestamp, data FROM messages ORDER BY rowid"):
        rows_left -= 1
        if key not in topics or not isinstance(data, bytes) or not isinstance(log_ns, int) or rows_left < 0:
            raise BagError(f"{path}: damaged: a row of 'messages' is not a message of a known topic")
        yield RawMessage(topics[key], log_ns, data)


def _scan_ros1(path: Path) -> Iterator[RawTopic | RawMessage]:
    topics: dict[int, RawTopic] = {}
    try:
        for connection, log_ns, data in ros1_bag.messages(path):
            if connection.id not in topics:
                topics[connection.id] = RawTopic(connection.topic, connection.msgtype, connection.digest, ros1=True)
                yield topics[connection.id]
            yield RawMessage(topics[connection.id], log_ns, data)
    except OSError as error:
        raise BagError(f"{path}: cannot be read: {error.strerror}") from error
    except (*ros1_bag.BROKEN, struct.error) as error:
        raise BagError(f"{path}: not a readable ROS 1 bag: {' '.join(str(error).split()) or 'damaged'}") from error


_READERS: dict[str, Callable[[Path], Iterator[RawTopic | RawMessage]]] = {
    ".mcap": _scan_mcap,
    ".db3": _scan_sqlite3,
    ".bag": _scan_ros1,
}

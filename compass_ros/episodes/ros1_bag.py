"""ROS 1 bags through rosbags, with memory bounded whatever the bag says of its sizes."""

from __future__ import annotations

import bz2
import struct
from collections.abc import Iterator
from pathlib import Path

import lz4.frame  # type: ignore[import-untyped]
from rosbags.interfaces import Connection, ConnectionExtRosbag1
from rosbags.rosbag1 import Reader, ReaderError
from rosbags.rosbag1.reader import Chunk, IndexData, decompressors

from compass_ros.episodes.raw import RawMessage, RawTopic, one_line
from compass_ros.errors import BagError

LARGEST_CHUNK = 256 * 2**20
"""A chunk that unpacks to more than this is refused [bytes]."""

BROKEN = (
    *(ReaderError, AssertionError, ValueError, LookupError, EOFError),
    *(RuntimeError, OverflowError, TypeError, MemoryError, struct.error),
)
"""What rosbags raises on a damaged ROS 1 bag."""


def messages(path: Path) -> Iterator[RawTopic | RawMessage]:
    """Topics and messages by log time. Raises BagError without the file's name, or OSError."""
    topics: dict[int, RawTopic] = {}
    try:
        with _BoundedReader(path) as reader:
            for connection, log_ns, data in reader.messages():
                if connection.id not in topics:
                    topics[connection.id] = _topic(connection)
                    yield topics[connection.id]
                yield RawMessage(topics[connection.id], log_ns, data)
    except BROKEN as error:
        hint = "; `rosbag reindex` of ROS 1 does it" if "not indexed" in str(error) else ""
        raise BagError(f"not a readable ROS 1 bag: {one_line(error)}{hint}") from error


def _topic(connection: Connection) -> RawTopic:
    """Each publisher has a connection of its own."""
    return RawTopic(
        connection.topic,
        connection.msgtype,
        connection.digest,
        ros1=True,
        definition=connection.msgdef.data,
        encoding="ros1msg",
        publisher=(connection.ext.callerid or "") if isinstance(connection.ext, ConnectionExtRosbag1) else "",
    )


class _BoundedReader(Reader):
    """rosbags' reader; a chunk unpacks to LARGEST_CHUNK at most, the index has no more entries than fit the file."""

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self._entries_left = path.stat().st_size // 12

    def read_chunk(self) -> Chunk:
        chunk = super().read_chunk()
        if chunk.decompressor is decompressors["bz2"]:
            return chunk._replace(decompressor=_bz2)
        if chunk.decompressor is decompressors["lz4"]:
            return chunk._replace(decompressor=_lz4)
        return chunk

    def read_index_data(self, pos: int, indexes: dict[int, list[IndexData]]) -> None:
        before = sum(len(index) for index in indexes.values())
        super().read_index_data(pos, indexes)
        self._entries_left -= sum(len(index) for index in indexes.values()) - before
        if self._entries_left < 0:
            raise ReaderError("The index has more entries than fit the file.")


def _bz2(data: bytes) -> bytes:
    return _whole(bz2.BZ2Decompressor().decompress(data, LARGEST_CHUNK + 1))


def _lz4(data: bytes) -> bytes:
    return _whole(lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=LARGEST_CHUNK + 1))


def _whole(data: bytes) -> bytes:
    if len(data) > LARGEST_CHUNK:
        raise ReaderError(f"A chunk unpacks to more than {LARGEST_CHUNK} bytes.")
    return data

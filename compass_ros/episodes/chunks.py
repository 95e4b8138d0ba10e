"""An MCAP file with chunks and index, of which no record is ever held back.

A chunk's header states length and checksum of its records, so writers keep a chunk in memory until it is full, and
lose it when they are killed. Here the records of a chunk that is open stand in the file where they will stay, behind a
record for private use that is as long as the header: at every moment the file is one without chunks that ends after its
last record, and any reader that goes from front to back reads it. A full chunk gets its header by one write of 49 bytes
over that private record, and its message index behind it.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    MessageIndex,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from mcap.writer import MCAP0_MAGIC

from compass_ros.episodes.checksum import joined
from compass_ros.episodes.record_file import RecordFile

CHUNK_BYTES = 2**20
"""A chunk that has so much is closed: what a look into the middle of a recording reads. As in mcap's writer."""

_MESSAGE = struct.Struct("<BQHIQQ")
"""A message without its data: opcode, length, channel, sequence, log time, publish time."""

_CHUNK = struct.Struct("<BQQQQIIQ")
"""An uncompressed chunk without its records: opcode, length, first and last log time, their size, their checksum,
length of the compression's name (0: none), their size."""

_FOOTER = struct.Struct("<BQQQ")
"""A footer without its checksum, which covers this too: opcode, length, where the summary and its offsets begin."""

_BEFORE_CONTENT = 9
"""Opcode and length of a record [bytes]."""

_PRIVATE = struct.pack("<BQ", 0x80, _CHUNK.size - _BEFORE_CONTENT) + bytes(_CHUNK.size - _BEFORE_CONTENT)
"""Stands where an open chunk's header will be. Opcodes from 0x80 are for private use: readers skip them."""


@dataclass
class _OpenChunk:
    start: int
    """Where its header will be in the file."""
    first_ns: int
    last_ns: int
    size: int = 0
    """Of its records [bytes]."""
    checksum: int = 0
    messages: dict[int, list[tuple[int, int]]] = field(default_factory=dict)
    """Channel -> log time, and place among the records, of each message."""


class ChunkedFile:
    """Schemas, channels and messages go in; `finish` writes the end. Log times must not decrease.

    Where the disk refuses, OSError is raised and all that was written before stays as it is; nothing more can be added.
    """

    def __init__(self, file: RecordFile, library: str) -> None:
        self._file = file
        self._chunk: _OpenChunk | None = None
        self._chunks: list[ChunkIndex] = []
        self._schemas: list[Schema] = []
        self._channels: list[Channel] = []
        self._undeclared: list[McapRecord] = []
        """Schemas and channels that go into the file before the next message."""
        self._counts: dict[int, int] = {}
        begin = MCAP0_MAGIC + _bytes([Header(profile="ros2", library=library)])
        self._checksum = zlib.crc32(begin)
        """Of all before the open chunk."""
        self._file.append([begin])

    def add_schema(self, name: str, encoding: str, text: bytes) -> int:
        """Declare a message type; its number."""
        schema = Schema(id=len(self._schemas) + 1, name=name, encoding=encoding, data=text)
        self._schemas.append(schema)
        self._undeclared.append(schema)
        return schema.id

    def add_channel(self, topic: str, schema: int, encoding: str, metadata: Mapping[str, str]) -> int:
        """Declare a topic; its number. `encoding`: of its messages."""
        channel = Channel(
            id=len(self._channels) + 1,
            topic=topic,
            message_encoding=encoding,
            metadata=dict(metadata),
            schema_id=schema,
        )
        self._channels.append(channel)
        self._undeclared.append(channel)
        return channel.id

    def add_message(self, channel: int, log_ns: int, publish_ns: int, data: bytes) -> None:
        """Append a message; it is in the file when this returns."""
        chunk = self._chunk
        if chunk is not None and chunk.size >= CHUNK_BYTES:
            self._close(chunk)
            chunk = None
        sequence = self._counts.get(channel, 0)
        length = _MESSAGE.size - _BEFORE_CONTENT + len(data)
        head = _MESSAGE.pack(Opcode.MESSAGE, length, channel, sequence, log_ns, publish_ns)
        declared = _bytes(self._undeclared) if self._undeclared else b""
        if chunk is None:
            chunk = _OpenChunk(self._file.end, first_ns=log_ns, last_ns=log_ns)
            self._file.append([_PRIVATE, declared, head, data])
            self._chunk = chunk
        else:
            self._file.append([declared, head, data])
        self._undeclared.clear()
        chunk.messages.setdefault(channel, []).append((log_ns, chunk.size + len(declared)))
        chunk.size += len(declared) + len(head) + len(data)
        chunk.checksum = zlib.crc32(data, zlib.crc32(declared + head, chunk.checksum))
        chunk.last_ns = log_ns
        self._counts[channel] = sequence + 1

    def finish(self, name: str, metadata: Mapping[str, str]) -> None:
        """Write a metadata record, the index and the end of the file."""
        if self._chunk is not None:
            self._close(self._chunk)
        declared = _bytes(self._undeclared)
        record = _bytes([Metadata(name=name, metadata=dict(metadata))])
        where = MetadataIndex(name=name, offset=self._file.end + len(declared), length=len(record))
        data = declared + record
        data += _bytes([DataEnd(zlib.crc32(data, self._checksum))])
        self._file.append([data, self._summary(where, self._file.end + len(data)), MCAP0_MAGIC])

    def _close(self, chunk: _OpenChunk) -> None:
        """Give the open chunk its header and its index."""
        length = _CHUNK.size - _BEFORE_CONTENT + chunk.size
        times = (chunk.first_ns, chunk.last_ns)
        header = _CHUNK.pack(Opcode.CHUNK, length, *times, chunk.size, chunk.checksum, 0, chunk.size)
        offsets, index = {}, b""
        for channel, messages in chunk.messages.items():
            offsets[channel] = self._file.end + len(index)
            index += _bytes([MessageIndex(channel, messages)])
        self._file.replace(chunk.start, header)
        self._file.append([index])
        self._checksum = joined(zlib.crc32(header, self._checksum), chunk.checksum, chunk.size)
        self._checksum = zlib.crc32(index, self._checksum)
        self._chunks.append(
            ChunkIndex(
                message_start_time=chunk.first_ns,
                message_end_time=chunk.last_ns,
                chunk_start_offset=chunk.start,
                chunk_length=len(header) + chunk.size,
                message_index_offsets=offsets,
                message_index_length=len(index),
                compression="",
                compressed_size=chunk.size,
                uncompressed_size=chunk.size,
            )
        )
        self._chunk = None

    def _summary(self, metadata: MetadataIndex, start: int) -> bytes:
        """Summary and footer of a file whose summary begins at `start`."""
        groups: list[tuple[Opcode, Sequence[McapRecord]]] = [
            (Opcode.SCHEMA, self._schemas),
            (Opcode.CHANNEL, self._channels),
            (Opcode.STATISTICS, [self._statistics()]),
            (Opcode.CHUNK_INDEX, self._chunks),
            (Opcode.METADATA_INDEX, [metadata]),
        ]
        summary, offsets = b"", []
        for opcode, records in groups:
            group = _bytes(records)
            if not group:
                continue
            offsets.append(SummaryOffset(opcode, start + len(summary), len(group)))
            summary += group
        offsets_start = start + len(summary)
        summary += _bytes(offsets)
        before = _FOOTER.pack(Opcode.FOOTER, _FOOTER.size + 4 - _BEFORE_CONTENT, start, offsets_start)
        checksum = zlib.crc32(before, zlib.crc32(summary))
        return summary + _bytes([Footer(summary_start=start, summary_offset_start=offsets_start, summary_crc=checksum)])

    def _statistics(self) -> Statistics:
        return Statistics(
            attachment_count=0,
            channel_count=len(self._channels),
            channel_message_counts=self._counts,
            chunk_count=len(self._chunks),
            message_count=sum(self._counts.values()),
            message_start_time=self._chunks[0].message_start_time if self._chunks else 0,
            message_end_time=self._chunks[-1].message_end_time if self._chunks else 0,
            metadata_count=1,
            schema_count=len(self._schemas),
        )


def _bytes(records: Iterable[McapRecord]) -> bytes:
    builder = RecordBuilder()
    for record in records:
        record.write(builder)
    return bytes(builder.end())  # type: ignore[no-untyped-call]

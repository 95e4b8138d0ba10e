"""Records of an MCAP file from front to back, with bounded memory whatever the file says of its sizes."""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Iterator
from contextlib import suppress
from io import BytesIO
from pathlib import Path
from typing import IO, cast

import lz4.frame  # type: ignore[import-untyped]
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile, McapError, UnsupportedCompressionError
from mcap.opcode import Opcode
from mcap.reader import SeekingReader
from mcap.records import Channel, Chunk, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import MCAP0_MAGIC

LARGEST_CHUNK = 256 * 2**20
"""A record that is longer than this, or a chunk that unpacks to more, is refused [bytes]."""

BROKEN = (McapError, ValueError, RuntimeError, EOFError, OverflowError, zstandard.ZstdError)
"""What a damaged file raises: mcap's own errors, bad text or checksums (ValueError), lz4 (RuntimeError), zstd."""


class _ExactStream:
    """A binary stream that gives exactly what is asked for, or raises EndOfFile before anything is allocated.

    `cut`: at its end it gives what is left instead.
    """

    def __init__(self, stream: IO[bytes], size: int, cut: bool = False) -> None:
        self._stream = stream
        self._cut = cut
        self.remaining = size

    def read(self, length: int) -> bytes:
        if self._cut:
            length = min(length, self.remaining)
        if not 0 <= length <= self.remaining:
            raise EndOfFile(f"a record says {length} bytes, {self.remaining} are left")
        data = self._stream.read(length)
        if len(data) != length:
            raise EndOfFile(f"the file ends {length - len(data)} bytes early")
        self.remaining -= length
        return data


def records(path: Path) -> Iterator[Schema | Channel | Message | Metadata]:
    """The records of an MCAP file in their order, those in chunks included.

    Raises one of `BROKEN` where the file is damaged or ends early (the data's checksum is verified), OSError where it
    cannot be read. Of a chunk in which the file ends, the whole records come first. Memory is bounded by the largest
    record that is really in the file and by LARGEST_CHUNK.
    """
    size = path.stat().st_size
    with path.open("rb") as file:
        stream = _ExactStream(file, size)
        reader = StreamReader(
            cast(IO[bytes], stream), emit_chunks=True, validate_crcs=True, record_size_limit=LARGEST_CHUNK
        )
        whole = 0
        try:
            for record in reader.records:
                whole = size - stream.remaining
                if isinstance(record, Chunk):
                    yield from _inside(_unpacked(record))
                elif isinstance(record, Schema | Channel | Message | Metadata):
                    yield record
        except EndOfFile:
            yield from _cut_chunk(file, whole, size)
            raise


def has_index(path: Path) -> bool:
    """Whether messages of a whole file can be found without reading all of it. Raises as `records`."""
    with path.open("rb") as file:
        summary = SeekingReader(file, record_size_limit=LARGEST_CHUNK).get_summary()
    return summary is not None and bool(summary.chunk_indexes)


def begins(path: Path) -> bool:
    """Whether the file begins as an MCAP file does; one that is cut off in its first bytes, or empty, may have."""
    with path.open("rb") as file:
        return MCAP0_MAGIC.startswith(file.read(len(MCAP0_MAGIC)))


def is_whole(path: Path) -> bool:
    """Whether the file ends as an MCAP file ends (the last 8 bytes; nothing else is read)."""
    with path.open("rb") as file:
        start = file.read(8)
        file.seek(max(path.stat().st_size - 8, 0))
        return file.read(8) == start == MCAP0_MAGIC and path.stat().st_size > 16


def _cut_chunk(file: IO[bytes], at: int, size: int) -> Iterator[Schema | Channel | Message]:
    """Whole records of the chunk in which a file ends, looked for from a record's beginning on. None: no such chunk."""
    file.seek(at)
    stream = _ExactStream(file, size - at, cut=True)
    data = ReadDataStream(cast(IO[bytes], stream))
    with suppress(*BROKEN, struct.error):
        opcode, length = data.read1(), data.read8()
        while opcode != Opcode.CHUNK and length < stream.remaining:  # records that readers skip
            file.seek(length, os.SEEK_CUR)
            stream.remaining -= length
            opcode, length = data.read1(), data.read8()
        if opcode == Opcode.CHUNK:
            yield from _inside(_content(Chunk.read(data)))


def _inside(data: bytes) -> Iterator[Schema | Channel | Message]:
    """Records in a chunk that is unpacked."""
    stream = _ExactStream(BytesIO(data), len(data))
    inner: Iterator[McapRecord] = iter(StreamReader(cast(IO[bytes], stream), skip_magic=True, emit_chunks=True).records)
    while stream.remaining:
        record = next(inner)
        if isinstance(record, Schema | Channel | Message):
            yield record


def _unpacked(chunk: Chunk) -> bytes:
    """Content of a whole chunk. Raises one of `BROKEN` where it is not what the chunk says."""
    data, size = _content(chunk), chunk.uncompressed_size
    if len(data) != size:
        raise McapError(f"a chunk says it unpacks to {size} bytes and unpacks to {len(data)}{'+' * (len(data) > size)}")
    if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
        raise McapError("a chunk's checksum is wrong")
    return data


def _content(chunk: Chunk) -> bytes:
    """Content of a chunk, as far as it is there: at most a byte more than it says, never more than LARGEST_CHUNK."""
    size = chunk.uncompressed_size
    if size > LARGEST_CHUNK:
        raise McapError(f"a chunk says it unpacks to {size} bytes; at most {LARGEST_CHUNK} are read")
    if chunk.compression == "zstd":
        with zstandard.ZstdDecompressor(max_window_size=LARGEST_CHUNK).stream_reader(chunk.data) as stream:
            return _at_most(stream, size + 1)
    if chunk.compression == "lz4":
        return bytes(lz4.frame.LZ4FrameDecompressor().decompress(chunk.data, max_length=size + 1))
    if chunk.compression == "":
        return chunk.data
    raise UnsupportedCompressionError(chunk.compression)


def _at_most(stream: IO[bytes], size: int) -> bytes:
    """Up to `size` bytes of a stream, in blocks, so that what is not there is not allocated."""
    blocks: list[bytes] = []
    while size > 0 and (block := stream.read(min(size, 2**20))):
        blocks.append(block)
        size -= len(block)
    return b"".join(blocks)

"""Records of an MCAP file from front to back, with bounded memory whatever the file says of its sizes."""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import IO, cast

import lz4.frame  # type: ignore[import-untyped]
import zstandard
from mcap.exceptions import EndOfFile, McapError, UnsupportedCompressionError
from mcap.records import Channel, Chunk, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import MCAP0_MAGIC

LARGEST_CHUNK = 256 * 2**20
"""A record that is longer than this, or a chunk that unpacks to more, is refused [bytes]."""

BROKEN = (McapError, ValueError, RuntimeError, EOFError, OverflowError, zstandard.ZstdError)
"""What a damaged file raises: mcap's own errors, bad text or checksums (ValueError), lz4 (RuntimeError), zstd."""


class _ExactStream:
    """A binary stream that gives exactly what is asked for, or raises EndOfFile before anything is allocated."""

    def __init__(self, stream: IO[bytes], size: int) -> None:
        self._stream = stream
        self.remaining = size

    def read(self, length: int) -> bytes:
        if not 0 <= length <= self.remaining:
            raise EndOfFile(f"a record says {length} bytes, {self.remaining} are left")
        data = self._stream.read(length)
        if len(data) != length:
            raise EndOfFile(f"the file ends {length - len(data)} bytes early")
        self.remaining -= length
        return data


def records(path: Path) -> Iterator[Schema | Channel | Message | Metadata]:
    """The records of a whole MCAP file in their order, those in chunks included.

    Raises one of `BROKEN` where the file is damaged or ends early (the data's checksum is verified), OSError where it
    cannot be read. Memory is bounded by the largest record that is really in the file and by LARGEST_CHUNK.
    """
    with path.open("rb") as file:
        stream = _ExactStream(file, path.stat().st_size)
        reader = StreamReader(
            cast(IO[bytes], stream), emit_chunks=True, validate_crcs=True, record_size_limit=LARGEST_CHUNK
        )
        for record in reader.records:
            if isinstance(record, Chunk):
                yield from _inside(record)
            elif isinstance(record, Schema | Channel | Message | Metadata):
                yield record


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


def _inside(chunk: Chunk) -> Iterator[Schema | Channel | Message]:
    """Records in a chunk."""
    data = _unpacked(chunk)
    stream = _ExactStream(BytesIO(data), len(data))
    inner: Iterator[McapRecord] = iter(StreamReader(cast(IO[bytes], stream), skip_magic=True, emit_chunks=True).records)
    while stream.remaining:
        record = next(inner)
        if isinstance(record, Schema | Channel | Message):
            yield record


def _unpacked(chunk: Chunk) -> bytes:
    """Content of a chunk, never more than it says and never more than LARGEST_CHUNK."""
    size = chunk.uncompressed_size
    if size > LARGEST_CHUNK:
        raise McapError(f"a chunk says it unpacks to {size} bytes; at most {LARGEST_CHUNK} are read")
    if chunk.compression == "zstd":
        with zstandard.ZstdDecompressor(max_window_size=LARGEST_CHUNK).stream_reader(chunk.data) as stream:
            data = _at_most(stream, size + 1)
    elif chunk.compression == "lz4":
        data = lz4.frame.LZ4FrameDecompressor().decompress(chunk.data, max_length=size + 1)
    elif chunk.compression == "":
        data = chunk.data
    else:
        raise UnsupportedCompressionError(chunk.compression)
    if len(data) != size:
        raise McapError(f"a chunk says it unpacks to {size} bytes and unpacks to {len(data)}{'+' * (len(data) > size)}")
    if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
        raise McapError("a chunk's checksum is wrong")
    return data


def _at_most(stream: IO[bytes], size: int) -> bytes:
    """Up to `size` bytes of a stream, in blocks, so that what is not there is not allocated."""
    blocks: list[bytes] = []
    while size > 0 and (block := stream.read(min(size, 2**20))):
        blocks.append(block)
        size -= len(block)
    return b"".join(blocks)

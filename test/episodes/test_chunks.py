"""The file under a bag, beside mcap's own writer and readers; whole at every moment, wherever it is cut off."""

from __future__ import annotations

import errno
import os
import zlib
from collections.abc import Sequence
from contextlib import suppress
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import SeekingReader
from mcap.records import Chunk, Message
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.writer import CompressionType, Writer

from compass_ros.episodes import chunks, mcap_stream
from compass_ros.episodes.checksum import joined
from compass_ros.episodes.chunks import ChunkedFile
from compass_ros.episodes.record_file import RecordFile

STEP_NS = 1_000_000


@pytest.mark.parametrize("sizes", [(0, 0), (1, 0), (0, 1), (9, 1), (1, 2**20), (2**20 + 7, 2**20 - 1), (5, 3_000_001)])
def test_the_checksum_of_two_pieces(sizes: tuple[int, int]) -> None:
    one, other = (np.random.default_rng(size).bytes(size) for size in sizes)
    assert joined(zlib.crc32(one), zlib.crc32(other), len(other)) == zlib.crc32(one + other)


@pytest.fixture
def small_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(chunks, "CHUNK_BYTES", 500)


def messages(count: int) -> list[tuple[int, bytes]]:
    """Channel 1, 2 or (in the second half) 3, and data of 0 to 200 bytes."""
    rng = np.random.default_rng(count)
    channels = [int(rng.integers(1, 4 if number >= count // 2 else 3)) for number in range(count)]
    return [(channel, rng.bytes(int(rng.integers(0, 201)))) for channel in channels]


def kind(number: int) -> tuple[str, str, bytes]:
    return f"pkg/msg/Kind{number}", "ros2msg", b"float64 x\n" * number


def written(file: RecordFile, count: int) -> ChunkedFile:
    """A file with messages on two topics, and on a third from the middle on."""
    mcap = ChunkedFile(file, "test")
    for number, (channel, data) in enumerate(messages(count)):
        for new in {0: (1, 2), count // 2: (3,)}.get(number, ()):
            mcap.add_channel(f"/topic{new}", mcap.add_schema(*kind(new)), "cdr", {"hash": f"RIHS01_{new}"})
        mcap.add_message(channel, number * STEP_NS, number, data)
        if isinstance(file, Watched):
            file.messages = number + 1
    return mcap


def written_by_mcap(count: int, chunk_sizes: list[int]) -> bytes:
    """The same by mcap's writer; `chunk_sizes`: messages in each chunk."""
    stream = BytesIO()
    mcap = Writer(stream, chunk_size=2**40, compression=CompressionType.NONE, enable_data_crcs=True)
    mcap.start("ros2", "test")
    counts = [0] * 4
    closing = set(np.cumsum(chunk_sizes).tolist())
    for number, (channel, data) in enumerate(messages(count)):
        if number in closing:
            mcap.flush()  # type: ignore[no-untyped-call]
        for new in {0: (1, 2), count // 2: (3,)}.get(number, ()):
            schema = mcap.register_schema(*kind(new))
            mcap.register_channel(f"/topic{new}", "cdr", schema, {"hash": f"RIHS01_{new}"})
        mcap.add_message(channel, number * STEP_NS, data, number, counts[channel])
        counts[channel] += 1
    mcap.flush()  # type: ignore[no-untyped-call]
    mcap.add_metadata("rosbag2", {"a": "b"})
    mcap.finish()  # type: ignore[no-untyped-call]
    return stream.getvalue()


def test_mcaps_own_writer_writes_the_same_bytes(tmp_path: Path, small_chunks: None) -> None:
    """Up to the summary: chunks, indexes, checksums. The summary holds the same records."""
    path = tmp_path / "a.mcap"
    written(RecordFile(path), 40).finish("rosbag2", {"a": "b"})
    ours = path.read_bytes()
    records = StreamReader(BytesIO(ours), emit_chunks=True, validate_crcs=True).records
    opened = [breakup_chunk(record) for record in records if isinstance(record, Chunk)]
    theirs = written_by_mcap(40, [sum(isinstance(record, Message) for record in chunk) for chunk in opened])
    found, expected = (SeekingReader(BytesIO(content)).get_summary() for content in (ours, theirs))
    assert found is not None
    assert expected is not None
    assert vars(found) == vars(expected)
    assert len(found.chunk_indexes) > 5
    where = found.metadata_indexes[0]
    data_end = where.offset + where.length + 13
    assert ours[:data_end] == theirs[:data_end]


def test_one_topic_and_a_stretch_of_time_are_found_by_the_index(tmp_path: Path, small_chunks: None) -> None:
    path = tmp_path / "a.mcap"
    written(RecordFile(path), 200).finish("rosbag2", {})
    expected = [(number * STEP_NS, data) for number, (channel, data) in enumerate(messages(200)) if channel == 2]
    with path.open("rb") as file:
        reader = SeekingReader(file, validate_crcs=True)
        found = reader.iter_messages("/topic2", starting_at=50 * STEP_NS, ending_before=150 * STEP_NS)
        assert [(message.log_time, message.data) for _, _, message in found] == [
            (at, data) for at, data in expected if 50 * STEP_NS <= at < 150 * STEP_NS
        ]


class Watched(RecordFile):
    """Notes every state that the file is in, also those in the middle of a write, and what must be found in it."""

    def __init__(self, path: Path) -> None:
        self.states: list[tuple[bytes, int]] = []
        self.messages = 0
        self._path = path
        super().__init__(path)

    def append(self, parts: Sequence[bytes]) -> None:
        before, added = self._path.read_bytes(), b"".join(parts)
        cuts = np.random.default_rng(len(before)).integers(0, len(added) + 1, 8)
        self.states += [(before + added[:cut], self.messages) for cut in cuts]
        super().append(parts)

    def replace(self, at: int, data: bytes) -> None:
        super().replace(at, data)
        self.states.append((self._path.read_bytes(), self.messages))


def test_in_every_state_of_the_file_every_message_is_read(tmp_path: Path, small_chunks: None) -> None:
    """So a process can be killed at any moment, also while it gives a chunk its header and its index."""
    file = Watched(tmp_path / "a.mcap")
    mcap = written(file, 40)
    mcap.finish("rosbag2", {"a": "b"})
    sent = [data for _, data in messages(40)]
    cut = tmp_path / "cut.mcap"
    assert len(file.states) > 400
    for content, expected in file.states:
        cut.write_bytes(content)
        found = read(cut)
        assert len(found) >= expected
        assert found == sent[: len(found)]


def read(path: Path) -> list[bytes]:
    """The messages before the cut."""
    found: list[bytes] = []
    with suppress(*mcap_stream.BROKEN):
        found.extend(record.data for record in mcap_stream.records(path) if isinstance(record, Message))
    return found


@pytest.mark.parametrize("fails_at", range(2, 40, 3))
def test_a_disk_that_refuses(
    tmp_path: Path, small_chunks: None, monkeypatch: pytest.MonkeyPatch, fails_at: int
) -> None:
    """Half of a write is done, then no more: the file ends where it ended before, and all that was taken is in it."""
    calls = iter(range(10**6))

    def refuse(descriptor: int, parts: Sequence[bytes], offset: int) -> int:
        if next(calls) < fails_at:
            return real(descriptor, parts, offset)
        os.pwrite(descriptor, b"".join(parts)[: sum(map(len, parts)) // 2], offset)
        raise OSError(errno.ENOSPC, "No space left on device")

    real = os.pwritev
    monkeypatch.setattr(os, "pwritev", refuse)
    file = Watched(tmp_path / "a.mcap")
    with pytest.raises(OSError, match="No space"):
        written(file, 40)
    found = read(tmp_path / "a.mcap")
    assert found == [data for _, data in messages(40)][: file.messages]
    assert file.end == (tmp_path / "a.mcap").stat().st_size

"""Damaged and lying bags: a BagError or a reading, nothing else; memory stays bounded. `fuzz_bags.py` tries more."""

from __future__ import annotations

import struct
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import lz4.frame  # type: ignore[import-untyped]
import pytest
import zstandard
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from compass_ros.episodes import list_topics, recover
from compass_ros.episodes.definitions import POSE_TYPE, embedded_definition
from compass_ros.episodes.writer import BagWriter
from compass_ros.errors import BagError
from test.episodes.hostile import Victim, damaged, mend, read, victims
from test.episodes.planted import START_NS, pose_bag, pose_bytes

MAGIC = b"\x89MCAP0\r\n"
BOUND = 64 * 2**20
"""[bytes] What reading a lying bag may take at most; most take nothing."""


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> list[Victim]:
    return victims(tmp_path_factory.mktemp("hostile"))


@settings(max_examples=250, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
@given(which=st.integers(0, 4), seed=st.integers(0, 2**32))
def test_damage_anywhere_gives_a_reading_or_a_complaint(sound: list[Victim], which: int, seed: int) -> None:
    victim = sound[which]
    found = read(victim, damaged(victim.content, seed))
    assert not isinstance(found, str) or (str(victim.bag) in found and "\n" not in found)


@settings(max_examples=40, deadline=None, derandomize=True)
@given(seed=st.integers(0, 2**32))
def test_damage_anywhere_can_be_recovered_or_not(sound: list[Victim], seed: int) -> None:
    mend(sound[0], damaged(sound[0].content, seed))


def test_damage_is_noticed(sound: list[Victim]) -> None:
    """The checksum leaves nothing unseen in the data of our own bags."""
    victim = sound[0]
    whole = read(victim, victim.content)
    data_end = victim.content.rindex(b"\x0f\x04\x00\x00\x00\x00\x00\x00\x00")
    for at in range(50, data_end, 97):
        content = bytearray(victim.content)
        content[at] ^= 0x10
        assert isinstance(read(victim, bytes(content)), str), f"byte {at} changed and nobody noticed"
    assert not isinstance(whole, str)


def record(opcode: int, content: bytes, length: int | None = None) -> bytes:
    return struct.pack("<BQ", opcode, len(content) if length is None else length) + content


def text(value: bytes, length: int | None = None) -> bytes:
    return struct.pack("<I", len(value) if length is None else length) + value


HEADER = record(1, text(b"ros2") + text(b""))
FOOTER = record(2, bytes(20)) + MAGIC


def chunk(kind: bytes, packed: bytes, says: int, packed_says: int | None = None) -> bytes:
    size = struct.pack("<Q", len(packed) if packed_says is None else packed_says)
    return record(6, struct.pack("<QQQI", 0, 1, says, 0) + text(kind) + size + packed)


def zeros(compress: Callable[[bytes], bytes], size: int) -> bytes:
    """A bomb: `size` zeros, packed."""
    return compress(bytes(size))


LIARS = {
    "record of 2^60 bytes": record(5, b"", 2**60),
    "record of 2^63 bytes": record(5, b"", 2**63),
    "message shorter than its header": record(5, bytes(22), 3),
    "attachment of 2^50 bytes": record(9, bytes(16) + text(b"a") + text(b"b") + struct.pack("<Q", 2**50)),
    "topic of 4 GB": record(4, struct.pack("<HH", 1, 0) + text(b"", 2**32 - 1)),
    "map of 4 GB": record(4, struct.pack("<HH", 1, 0) + text(b"/t") + text(b"cdr") + struct.pack("<I", 2**32 - 1)),
    "chunk that says 2^40": chunk(b"", b"", 2**40),
    "chunk packed into 2^40": chunk(b"zstd", b"", 10, 2**40),
    "zstd bomb that says so": chunk(b"zstd", zeros(zstandard.compress, 2**30), 2**30),
    "zstd bomb that says 10": chunk(b"zstd", zeros(zstandard.compress, 2**28), 10),
    "zstd bomb that says 0": chunk(b"zstd", zeros(zstandard.compress, 2**28), 0),
    "lz4 bomb that says so": chunk(b"lz4", zeros(lz4.frame.compress, 2**29), 2**29),
    "lz4 bomb that says 10": chunk(b"lz4", zeros(lz4.frame.compress, 2**28), 10),
    "zstd that is none": chunk(b"zstd", b"hello", 100),
    "lz4 that is none": chunk(b"lz4", b"hello", 100),
    "chunk in a chunk": chunk(b"", chunk(b"zstd", zeros(zstandard.compress, 2**28), 2**28), 0),
    "unknown compression": chunk(b"rar", b"hello", 5),
    "name that is no text": record(3, struct.pack("<H", 1) + text(b"\xff\xfe") + text(b"") + text(b"")),
    "message without a channel": record(5, struct.pack("<HIQQ", 9, 0, 0, 0) + b"x"),
}


@pytest.mark.parametrize("lie", LIARS)
def test_memory_is_bounded_for_bags_that_lie(tmp_path: Path, lie: str) -> None:
    path = tmp_path / "liar.mcap"
    path.write_bytes(MAGIC + HEADER + LIARS[lie] + FOOTER)
    tracemalloc.start()
    try:
        with pytest.raises(BagError, match="damaged"):
            list_topics(path)
        assert tracemalloc.get_traced_memory()[1] < BOUND
    finally:
        tracemalloc.stop()


def test_a_record_that_really_is_too_large(tmp_path: Path) -> None:
    """A sparse file of 1 GB that is one record."""
    path = tmp_path / "large.mcap"
    with path.open("wb") as file:
        file.write(MAGIC + HEADER + struct.pack("<BQ", 0x80, 2**30))
        file.truncate(2**30 + 100)
        file.seek(2**30 + 100 - len(FOOTER))
        file.write(FOOTER)
    tracemalloc.start()
    try:
        with pytest.raises(BagError, match="damaged"):
            list_topics(path)
        assert tracemalloc.get_traced_memory()[1] < BOUND
    finally:
        tracemalloc.stop()


BOMB = "a: &a [x, x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"{name}: &{name} [{', '.join([f'*{before}'] * 10)}]\n" for before, name in zip("abcdefgh", "bcdefghi", strict=True)
)
MERGES = "a: &a {k: 1}\n" + "".join(
    f"{name}: &{name} {{<<: [{', '.join([f'*{before}'] * 10)}]}}\n"
    for before, name in zip("abcdefgh", "bcdefghi", strict=True)
)


@pytest.mark.parametrize(
    "metadata",
    [
        BOMB + "rosbag2_bagfile_information: {storage_identifier: *i}",
        MERGES + "rosbag2_bagfile_information: {<<: *i}",
        "[" * 1_000,
        "rosbag2_bagfile_information: !!python/object/apply:os.system ['echo run']",
    ],
    ids=["aliases", "merges", "depth", "python"],
)
def test_metadata_that_explodes(tmp_path: Path, metadata: str) -> None:
    bag = pose_bag(tmp_path / "bag", [START_NS], [(0, 0)])
    (bag / "metadata.yaml").write_text(metadata)
    tracemalloc.start()
    try:
        with pytest.raises(BagError, match=r"expected a rosbag2 metadata\.yaml"):
            list_topics(bag)
        assert tracemalloc.get_traced_memory()[1] < BOUND
    finally:
        tracemalloc.stop()


def test_qos_of_a_cut_bag_is_not_trusted(tmp_path: Path) -> None:
    for number, qos in enumerate([BOMB, "[", "{", "- x", "[" * 5_000]):
        writer = BagWriter(tmp_path / str(number))
        channel = writer.add_topic("/pose", embedded_definition(POSE_TYPE), qos)
        writer.write(channel, 1, 1, pose_bytes(START_NS))
        writer.abandon()
        recover(writer.folder)
        assert [topic.messages for topic in list_topics(writer.folder)] == [1]

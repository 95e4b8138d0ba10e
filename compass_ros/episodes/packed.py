"""Files and messages that rosbag2 packed with zstd, with memory and disk bounded whatever they unpack to."""

from __future__ import annotations

import shutil
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import zstandard

from compass_ros.episodes.raw import one_line
from compass_ros.errors import BagError

LARGEST_MESSAGE = 256 * 2**20
"""Of one message unpacked [bytes]."""
ENDINGS = (".zstd", ".zst")
"""Of a whole file packed by rosbag2 (`compression_mode: file`), and by the command `zstd`."""
_LARGEST_WINDOW = 128 * 2**20
"""What a frame may look back [bytes]: the most that the command `zstd` unpacks without being asked to."""
_STEP = 1024
"""Bytes unpacked at once: a block of zstd makes at most 128 KiB of 4 bytes, so this makes at most 32 MiB."""


def plain_name(path: Path) -> str:
    """`x.mcap` for `x.mcap` and for `x.mcap.zstd`."""
    return path.stem if path.suffix in ENDINGS else path.name


def kind(path: Path) -> str:
    """`.mcap` for `x.mcap` and for `x.mcap.zstd`."""
    return Path(plain_name(path)).suffix


def is_packed(message: bytes) -> bool:
    """Whether a message is packed (`compression_mode: message`); one in CDR begins with a zero."""
    return message.startswith(zstandard.FRAME_HEADER)


@contextmanager
def unpacked(path: Path) -> Iterator[Path]:
    """The file itself, or what is packed in it, in a temporary folder. Raises BagError where it does not unpack."""
    if path.suffix not in ENDINGS:
        yield path
        return
    with TemporaryDirectory(prefix="compass_") as folder:
        plain = Path(folder, path.stem)
        with path.open("rb") as packed, plain.open("wb") as file:
            left = shutil.disk_usage(folder).free // 2  # what others write must find room too
            for block in _blocks(iter(lambda: packed.read(_STEP), b"")):
                left -= len(block)
                if left < 0:
                    raise BagError(f"does not unpack into half of what is free in {folder}; TMPDIR names another place")
                file.write(block)
        yield plain


def unpacked_message(data: bytes) -> bytes:
    """A message of rosbag2's `compression_mode: message`. Raises BagError."""
    found = bytearray()
    for block in _blocks(data[start : start + _STEP] for start in range(0, len(data), _STEP)):
        found += block
        if len(found) > LARGEST_MESSAGE:
            raise BagError(f"a message unpacks to more than {LARGEST_MESSAGE} bytes")
    return bytes(found)


def _blocks(packed: Iterable[bytes]) -> Iterator[bytes]:
    """What zstd frames in a row hold, in pieces. Raises BagError where they are damaged or cut off."""
    unpacker = zstandard.ZstdDecompressor(max_window_size=_LARGEST_WINDOW)
    frame = unpacker.decompressobj()
    try:
        for block in packed:
            rest = block
            while rest:
                if frame.eof:
                    frame = unpacker.decompressobj()
                yield frame.decompress(rest)
                rest = frame.unused_data
    except zstandard.ZstdError as error:
        raise BagError(f"not packed with zstd, or damaged: {one_line(error)}") from error
    if not frame.eof:
        raise BagError("truncated: packed with zstd, and the end is missing")

"""Bags damaged on purpose: the same damage for a given seed, from one flipped byte to sizes that lie."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rosbags.rosbag2 import CompressionMode, StoragePlugin

from compass_ros.episodes import BagContent, read_bag, recover, write_episode
from compass_ros.episodes.sources import Source
from compass_ros.errors import BagError
from test.episodes.foreign import SOURCES, write_ros1, write_ros1_mcap, write_rosbag2
from test.episodes.planted import ALL, episode

LIES = [0, 1, 0xFF, 0x7FFFFFFF, 0xFFFFFFFF, 2**40, 2**63 - 1, 2**64 - 1]


@dataclass(frozen=True)
class Victim:
    """A sound bag and one file of it to be damaged."""

    bag: Path
    file: Path
    content: bytes
    sources: tuple[Source, ...]


def victims(folder: Path) -> list[Victim]:
    """Our own bag's data and metadata, and other people's formats."""
    own = write_episode(episode(frames=8), folder)
    mcap = write_rosbag2(folder / "mcap", StoragePlugin.MCAP)
    sqlite = write_rosbag2(folder / "sqlite", StoragePlugin.SQLITE3)
    packed = write_rosbag2(folder / "packed", StoragePlugin.MCAP, compression=CompressionMode.FILE)
    ros1 = write_ros1(folder / "ros1.bag")
    converted = write_ros1_mcap(folder / "converted.mcap")
    files = [
        (own, own / "shot_0.mcap", ALL),
        (own, own / "metadata.yaml", ALL),
        (mcap, mcap / "mcap.mcap", SOURCES),
        (sqlite, sqlite / "sqlite.db3", SOURCES),
        (packed, packed / "packed.mcap.zstd", SOURCES),
        (ros1, ros1, SOURCES),
        (converted, converted, SOURCES),
    ]
    return [Victim(bag, file, file.read_bytes(), sources) for bag, file, sources in files]


def damaged(content: bytes, seed: int) -> bytes:
    """One to four kinds of damage at random places."""
    rng = np.random.default_rng(seed)
    found = bytearray(content)
    for _ in range(int(rng.integers(1, 5))):
        at = int(rng.integers(0, max(len(found), 1)))
        length = int(rng.integers(1, 64))
        match int(rng.integers(0, 6)):
            case 0:
                found[at : at + 1] = rng.bytes(1)
            case 1:
                found[at : at + length] = rng.bytes(length)
            case 2:
                del found[at : at + length]
            case 3:
                found[at:at] = found[at : at + length]
            case 4:
                width = int(rng.choice([1, 2, 4, 8]))
                lie = int(LIES[int(rng.integers(len(LIES)))]) % 2 ** (8 * width)
                found[at : at + width] = lie.to_bytes(width, "little")
            case _:
                del found[at:]
    return bytes(found)


def read(victim: Victim, content: bytes) -> BagContent | str:
    """What reading gives, or its complaint; anything else than a BagError goes through."""
    victim.file.write_bytes(content)
    try:
        return read_bag(victim.bag, victim.sources)
    except BagError as error:
        return str(error)
    finally:
        victim.file.write_bytes(victim.content)


def mend(victim: Victim, content: bytes) -> int | str:
    """What recovery gives when the damaged file has no metadata."""
    folder = victim.bag.parent / "mend"
    folder.mkdir(exist_ok=True)
    for old in folder.iterdir():
        old.unlink()
    (folder / "mend_0.mcap").write_bytes(content)
    try:
        return recover(folder).messages
    except BagError as error:
        assert not (folder / "metadata.yaml").exists()
        return str(error)

"""Any bag as a stream of raw messages: rosbag2 (MCAP, sqlite3) and ROS 1, whole or refused with one line."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from rosbags.serde import SerdeError

from compass_ros.episodes import mcap_bag, metadata, packed, ros1_bag, sqlite3_bag
from compass_ros.episodes.definitions import embedded_definition, ros1_typestore, typestore
from compass_ros.episodes.raw import CutOffError, RawMessage, RawTopic, Remark
from compass_ros.errors import BagError

__all__ = [
    "RawMessage",
    "RawTopic",
    "Remark",
    "bag_name",
    "bag_of",
    "decode",
    "is_bag",
    "known_digest",
    "scan",
    "scan_file",
    "storage_files",
]

_READERS: Mapping[str, Callable[[Path], Iterator[RawTopic | RawMessage]]] = {
    ".mcap": mcap_bag.messages,
    ".db3": sqlite3_bag.messages,
    ".bag": ros1_bag.messages,
}
"""By ending of the file, that of its packing left out."""


def is_bag(path: Path) -> bool:
    """Whether a path looks like a bag, whole or not: a .mcap, .db3 or .bag file (packed or not), or a rosbag2 folder.

    A folder without metadata.yaml counts where a file in it is named after it, as the files of a cut-off bag are.
    """
    if path.is_dir():
        return (path / metadata.FILE_NAME).exists() or bool(storage_files(path))
    return packed.kind(path) in _READERS


def scan(path: Path) -> Iterator[RawTopic | RawMessage | Remark]:
    """All topics and messages of a bag, in the order of its files; a topic comes before its messages.

    A folder without metadata.yaml is read where all its files have their end.

    Raises BagError (also in the middle): missing, empty, truncated, not a bag, or fewer messages than its
    metadata says.
    """
    if path.is_dir():
        yield from _scan_folder(path)
    elif not path.exists():
        raise BagError(f"{path}: no such bag")
    elif is_bag(path):
        yield from scan_file(path)
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


def storage_files(folder: Path) -> list[Path]:
    """The files in a folder that are named after it, as rosbag2 names those of a bag, in the order of recording."""
    found = [file for file in folder.glob("*") if packed.kind(file) in (".mcap", ".db3")]
    return sorted((file for file in found if file.name.startswith(folder.name)), key=_number)


def _number(file: Path) -> tuple[int, str]:
    """Order of the files of a recording that was split: NAME_0, NAME_1, ..., NAME_10."""
    match = re.search(r"_(\d{1,9})\.", file.name)
    return int(match[1]) if match else 0, file.name


def bag_name(path: Path) -> str:
    """What a bag is called that does not say its episode's name: its folder, or its file without endings."""
    return path.resolve().name if path.is_dir() else Path(packed.plain_name(path)).stem


def bag_of(path: Path) -> Path:
    """The folder of a file that is part of a rosbag2 folder; the path itself for a bare file, or a folder."""
    part = path.is_file() and ((path.parent / metadata.FILE_NAME).exists() or path in storage_files(path.parent))
    return path.parent if part else path


def _scan_folder(folder: Path) -> Iterator[RawTopic | RawMessage | Remark]:
    there = storage_files(folder)
    if (folder / metadata.FILE_NAME).exists():
        summary = metadata.read_summary(folder)
        files = [_present(folder, name, summary.storage) for name in summary.files]
        remark = _not_named(files, there)
    elif there:
        summary, files, remark = None, there, _without_metadata(there)
    else:
        raise BagError(f"{folder}: expected a bag, found a folder without metadata.yaml and without messages")
    if remark:
        yield Remark(remark)
    digests = {(topic.name, topic.type): topic.digest for topic in summary.topics} if summary else {}
    found = 0
    for file in files:
        full: dict[int, RawTopic] = {}  # by identity: a comparison for each message would cost as much as its reading
        for item in scan_file(file):
            if isinstance(item, RawTopic):
                full[id(item)] = replace(item, digest=item.digest or digests.get((item.name, item.type), ""))
                yield full[id(item)]
            else:
                found += 1
                yield RawMessage(full[id(item.topic)], item.log_ns, item.data)
    if not found:
        raise BagError(f"{folder}: empty, it holds no messages")
    if summary and found != summary.messages:
        raise BagError(f"{folder}: damaged: metadata.yaml says {summary.messages} messages, the files hold {found}")


def scan_file(file: Path) -> Iterator[RawTopic | RawMessage]:
    """Topics and messages of one file of a bag, whatever the others hold. Raises BagError."""
    try:
        with packed.unpacked(file) as plain:
            for item in _READERS[plain.suffix](plain):
                if isinstance(item, RawMessage) and not item.topic.ros1 and packed.is_packed(item.data):
                    yield replace(item, data=packed.unpacked_message(item.data))
                else:
                    yield item
    except CutOffError as error:
        raise BagError(f"{file}: {error}; run: compass record --recover {shlex.quote(str(bag_of(file)))}") from error
    except BagError as error:
        raise BagError(f"{file}: {error}") from error
    except OSError as error:
        raise BagError(f"{file}: cannot be read: {error.strerror}") from error


def _present(folder: Path, name: str, storage: str) -> Path:
    """The file that metadata.yaml names, packed or unpacked since. The ending says how it is stored."""
    plain = packed.plain_name(Path(name))
    for file in (folder / name, folder / plain, *(folder / (plain + ending) for ending in packed.ENDINGS)):
        if file.exists():
            if packed.kind(file) in _READERS:
                return file
            raise BagError(f"{folder}: storage '{storage}' of {name} cannot be read; expected mcap or sqlite3")
    raise BagError(f"{folder}: metadata.yaml names {name}, which is missing")


def _not_named(named: Sequence[Path], there: Sequence[Path]) -> str:
    known = {packed.plain_name(file) for file in named}
    others = [file.name for file in there if packed.plain_name(file) not in known]
    return f"metadata.yaml does not name {', '.join(others)}: not read" if others else ""


def _without_metadata(files: Sequence[Path]) -> str:
    numbers = [_number(file)[0] for file in files]
    missing = sorted({*range(numbers[0], numbers[-1])} - {*numbers})
    gap = f", and number {', '.join(map(str, missing[:6]))} is missing among them" if missing else ""
    return f"without metadata.yaml, read from {len(files)} file{'s' * (len(files) > 1)} as they lie there{gap}"

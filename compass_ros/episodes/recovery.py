"""A bag that was cut off (recorder killed, disk full) becomes whole again: all up to the cut, nothing invented."""

from __future__ import annotations

import fcntl
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path

from mcap.records import Channel, Message, Schema

from compass_ros.episodes import mcap_stream, metadata
from compass_ros.episodes.bag import RawMessage, RawTopic, decode, scan
from compass_ros.episodes.definitions import EPISODE_TYPE, EPISODE_TYPES, Definition, embedded_definition
from compass_ros.episodes.notes import EPISODE_TOPIC, EpisodeHeader, header, header_bytes
from compass_ros.episodes.writer import BagWriter, sync_bag
from compass_ros.errors import BagError

_WORK_FOLDER = ".recovering"


@dataclass(frozen=True)
class Recovery:
    """What became of a bag."""

    bag: Path
    messages: int
    """Messages in the bag now."""
    was_whole: bool
    """Nothing had to be done."""


def recover(path: str | Path) -> Recovery:
    """Make a bag whole that has no end: keep every whole message before the cut, write the end and metadata.yaml.

    The bag is replaced in one step, when its recovered copy is complete; a bag that is whole is left as it is. Works
    for MCAP bags of one file, whoever recorded them.

    Raises:
        BagError: No such bag, it is being recorded now, it holds no message, it is not MCAP, or the disk is full.
    """
    folder = _folder(Path(path))
    file = _mcap_file(folder)
    with _locked(file):
        whole = _messages_if_whole(folder)
        if whole is not None:
            return Recovery(folder, whole, was_whole=True)
        work = folder / _WORK_FOLDER
        try:
            shutil.rmtree(work, ignore_errors=True)
            kept = _rewrite(file, work)
            sync_bag(work)
            (work / file.name).replace(file)
            (work / metadata.FILE_NAME).replace(folder / metadata.FILE_NAME)
        except OSError as error:
            raise BagError(f"{folder}: cannot be recovered: {error.strerror}") from error
        finally:
            shutil.rmtree(work, ignore_errors=True)
    return Recovery(folder, kept, was_whole=False)


def unfinished(folder: Path) -> tuple[Path, ...]:
    """Bags directly in a folder that have messages and no metadata.yaml: cut off, or being recorded."""
    return tuple(sorted(p for p in folder.glob("*") if any(p.glob("*.mcap")) and not (p / metadata.FILE_NAME).exists()))


def _folder(path: Path) -> Path:
    folder = path.parent if path.suffix == ".mcap" and path.is_file() else path
    if not folder.is_dir():
        raise BagError(f"{path}: no such bag")
    return folder


def _mcap_file(folder: Path) -> Path:
    files = sorted(folder.glob("*.mcap"))
    if len(files) != 1:
        raise BagError(f"{folder}: expected one .mcap file to recover, found {[file.name for file in files]}")
    return files[0]


@contextmanager
def _locked(file: Path) -> Iterator[None]:
    """Hold the lock that a writer of this file holds."""
    try:
        descriptor = os.open(file, os.O_RDONLY)
    except OSError as error:
        raise BagError(f"{file}: cannot be read: {error.strerror}") from error
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        yield
    except BlockingIOError:
        raise BagError(f"{file.parent}: is being recorded now; stop the episode first") from None
    finally:
        os.close(descriptor)


def _messages_if_whole(folder: Path) -> int | None:
    try:
        return sum(isinstance(item, RawMessage) for item in scan(folder))
    except BagError:
        return None


def _rewrite(file: Path, work: Path) -> int:
    """Write every whole message of a file to a whole bag in the folder `work`; returns how many. Raises BagError."""
    writer = BagWriter(work, file.name)
    try:
        last = _copy(file, writer)
        if not writer.messages:
            raise BagError(f"{file}: holds no whole message; nothing to recover")
        if last is not None and last.state == "recording":
            _say_recovered(writer, last)
        writer.close()
    except BagError:
        writer.abandon()
        raise
    return writer.messages


def _copy(file: Path, writer: BagWriter) -> EpisodeHeader | None:
    """Copy what can be read; returns the last header of the episode, if there is one."""
    schemas: dict[int, Schema] = {}
    channels: dict[int, tuple[int, RawTopic]] = {}
    last: EpisodeHeader | None = None
    with suppress(*mcap_stream.BROKEN):  # the cut
        for record in mcap_stream.records(file):
            if isinstance(record, Schema):
                schemas[record.id] = record
            elif isinstance(record, Channel) and record.id not in channels and record.schema_id in schemas:
                channels[record.id] = _declare(writer, record, schemas[record.schema_id])
            elif isinstance(record, Message) and record.channel_id in channels:
                channel, topic = channels[record.channel_id]
                writer.write(channel, record.log_time, record.publish_time, record.data)
                if topic.type in EPISODE_TYPES:
                    with suppress(BagError):  # another version's message: kept as it is
                        last = header(decode(RawMessage(topic, record.log_time, record.data)))
    return last


def _declare(writer: BagWriter, channel: Channel, schema: Schema) -> tuple[int, RawTopic]:
    digest = channel.metadata.get("topic_type_hash", "")
    definition = Definition(schema.name, schema.data.decode(), digest, schema.encoding)
    number = writer.add_topic(channel.topic, definition, channel.metadata.get("offered_qos_profiles", ""))
    return number, RawTopic(channel.topic, schema.name, digest)


def _say_recovered(writer: BagWriter, last: EpisodeHeader) -> None:
    count = writer.messages
    channel = writer.add_topic(EPISODE_TOPIC, embedded_definition(EPISODE_TYPE))
    said = replace(
        last,
        state="recovered",
        duration_ns=writer.duration_ns,
        messages=count,
        topics=tuple(writer.counts()),
        message=f"the recording was cut off; {count} messages were recovered",
    )
    writer.write(channel, writer.last_ns, writer.last_ns, header_bytes(said))

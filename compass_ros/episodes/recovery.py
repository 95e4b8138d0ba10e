"""Bags written anew: one that was cut off becomes whole, nothing invented; one without an index gets it."""

from __future__ import annotations

import fcntl
import os
import shutil
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path

from mcap.records import Channel, Message, Metadata, Schema

from compass_ros.episodes import mcap_stream, metadata, packed
from compass_ros.episodes.bag import RawMessage, RawTopic, bag_of, decode, scan, scan_file, storage_files
from compass_ros.episodes.definitions import (
    EPISODE_TYPE,
    EPISODE_TYPES,
    SHOT_TYPE,
    SHOT_TYPES,
    Definition,
    embedded_definition,
)
from compass_ros.episodes.notes import EPISODE_TOPIC, EpisodeHeader, header, header_bytes
from compass_ros.episodes.writer import BagWriter, sync_bag
from compass_ros.errors import BagError

_WORK_FOLDER = ".recovering_"
"""Followed by the name of the file that is written anew in it."""


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

    A file is replaced in one step, when its recovered copy is complete; what is whole is left as it is. Works for MCAP
    bags of one file or several, whoever recorded them, and for a bare .mcap file, which gets no metadata.yaml. Of a
    sqlite3 bag only metadata.yaml can be missing. Messages of this package get the package's present name.

    Raises:
        BagError: No such bag, it is being recorded now, it holds no message, it cannot be read, or the disk is full.
    """
    bag = bag_of(Path(path))
    files = _files(bag)
    with _locked(files):
        counts = {file: _messages_if_whole(file) for file in files}
        cut = [file for file, count in counts.items() if count is None]
        described = bag.is_file() or (bag / metadata.FILE_NAME).exists()
        if described and not cut and (whole := _messages_if_whole(bag)) is not None:
            return Recovery(bag, whole, was_whole=True)
        kept = _written(bag, files, cut, empty=not any(counts.values()))
    return Recovery(bag, kept, was_whole=False)


def reindex(path: str | Path) -> Recovery:
    """Give a whole bag chunks, a message index, and a metadata record that rosbag2 reads, which version 0.1 left out.

    The messages stay as they are, in the same order, with the same stamps. Otherwise as `recover`: a file that lacks
    nothing is left as it is (`was_whole`: all are), a sqlite3 bag too.

    Raises:
        BagError: As `recover`, and where the bag is not whole.
    """
    bag = bag_of(Path(path))
    files = _files(bag)
    with _locked(files):
        count = sum(isinstance(item, RawMessage) for item in scan(bag))
        plain = [file for file in files if file.suffix == ".mcap" and not _indexed(file)]
        if not plain:
            return Recovery(bag, count, was_whole=True)
        return Recovery(bag, _written(bag, files, plain, empty=False), was_whole=False)


def unfinished(folder: Path) -> tuple[Path, ...]:
    """Bags directly in a folder that have messages and no metadata.yaml: cut off, or being recorded."""
    return tuple(sorted(p for p in folder.glob("*") if any(p.glob("*.mcap")) and not (p / metadata.FILE_NAME).exists()))


def _files(bag: Path) -> list[Path]:
    """The files of a bag in the order of recording."""
    if not bag.exists():
        raise BagError(f"{bag}: no such bag")
    if bag.is_file():
        return [bag]
    files = storage_files(bag) or sorted(bag.glob("*.mcap"))
    if not files or (len(files) > 1 and not storage_files(bag)):
        found = [file.name for file in files]
        raise BagError(f"{bag}: expected one .mcap file to recover, or several named after the folder, found {found}")
    return files


def _written(bag: Path, files: Sequence[Path], anew: Sequence[Path], empty: bool) -> int:
    """Write some of a bag's files anew, and its metadata.yaml; the number of its messages. `empty`: as in `_mend`."""
    try:
        _mend(anew, empty)
        summary = _summary(files)
        if not summary.messages:
            raise BagError(f"{bag}: holds no message; nothing to recover")
        if bag.is_dir():
            metadata.write_summary(bag, summary)
            sync_bag(bag)
    except OSError as error:
        raise BagError(f"{bag}: cannot be written anew: {error.strerror}") from error
    return summary.messages


def _mend(files: Sequence[Path], empty: bool) -> None:
    """Write files anew, all or none; `empty`: the bag's other files hold no message.

    Raises OSError, or BagError where one is not MCAP, or no message is left.
    """
    works = [file.parent / (_WORK_FOLDER + file.name) for file in files]
    try:
        for work in works:
            shutil.rmtree(work, ignore_errors=True)
        kept = [_rewrite(file, work) for file, work in zip(files, works, strict=True)]
        if empty and files and not sum(kept):
            raise BagError(f"{files[0]}: holds no whole message; nothing to recover")
        for file, work in zip(files, works, strict=True):
            sync_bag(work)
            (work / file.name).replace(file)
    finally:
        for work in works:
            shutil.rmtree(work, ignore_errors=True)


def _summary(files: Sequence[Path]) -> metadata.BagSummary:
    """What metadata.yaml says of whole files."""
    counts: dict[RawTopic, int] = {}
    stamps: list[int] = []
    for item in (item for file in files for item in scan_file(file)):
        if isinstance(item, RawTopic):
            counts.setdefault(item, 0)
        else:
            counts[item.topic] += 1
            stamps = [min(item.log_ns, *stamps), max(item.log_ns, *stamps)] if stamps else [item.log_ns] * 2
    first, last = stamps or [0, 0]
    storage = {".mcap": "mcap", ".db3": "sqlite3"}[packed.kind(files[0])]
    topics = tuple(
        metadata.TopicCount(t.name, t.type, t.digest, count, t.qos, "ros1" if t.ros1 else "cdr")
        for t, count in counts.items()
    )
    names = tuple(file.name for file in files)
    return metadata.BagSummary(storage, names, first, last - first, sum(counts.values()), topics)


def _indexed(file: Path) -> bool:
    """Whether a whole MCAP file has an index of its messages, and no metadata record that rosbag2 cannot read."""
    return mcap_stream.has_index(file) and all(
        metadata.is_record(record.metadata.get(metadata.RECORD_KEY, ""))
        for record in mcap_stream.records(file)
        if isinstance(record, Metadata) and record.name == metadata.RECORD_NAME
    )


@contextmanager
def _locked(files: Sequence[Path]) -> Iterator[None]:
    """Hold the locks that the writers of these files hold."""
    with ExitStack() as locks:
        for file in files:
            locks.enter_context(_lock(file))
        yield


@contextmanager
def _lock(file: Path) -> Iterator[None]:
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


def _messages_if_whole(path: Path) -> int | None:
    try:
        items = scan_file(path) if path.is_file() else scan(path)
        return sum(isinstance(item, RawMessage) for item in items)
    except BagError:
        return None


def _rewrite(file: Path, work: Path) -> int:
    """Write every whole message of a file to a whole bag in the folder `work`; returns how many. Raises BagError."""
    if file.suffix != ".mcap":
        raise BagError(f"{file}: damaged; only .mcap files can be recovered")
    writer = BagWriter(work, file.name)
    try:
        last = _copy(file, writer)
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
                if topic.name == EPISODE_TOPIC and topic.type in EPISODE_TYPES:
                    with suppress(BagError):  # another version's message: kept as it is
                        last = header(decode(RawMessage(topic, record.log_time, record.data)))
    return last


def _declare(writer: BagWriter, channel: Channel, schema: Schema) -> tuple[int, RawTopic]:
    digest = channel.metadata.get("topic_type_hash", "")
    definition = _present(Definition(schema.name, schema.data.decode(), digest, schema.encoding))
    qos = channel.metadata.get("offered_qos_profiles", "")
    number = writer.add_topic(channel.topic, definition, qos, channel.message_encoding)
    return number, RawTopic(channel.topic, definition.type, definition.digest)


def _present(definition: Definition) -> Definition:
    """A message of this package under the name that the package has now, if it is the same message."""
    for name, names in ((EPISODE_TYPE, EPISODE_TYPES), (SHOT_TYPE, SHOT_TYPES)):
        if definition.type in names and definition.digest == embedded_definition(definition.type).digest:
            return embedded_definition(name)
    return definition


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

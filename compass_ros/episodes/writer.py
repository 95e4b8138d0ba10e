"""Crash-safe writing of a rosbag2 MCAP bag.

Every message is one record in the file as soon as it is written: no chunks, no buffer in this process. A process that
is killed loses nothing that it had written; what is left is a file without an end, in a folder without metadata.yaml,
which `recovery.recover` makes whole. A write that fails (disk full) is taken back: the file ends on a whole record.
"""

from __future__ import annotations

import fcntl
import os
from pathlib import Path
from typing import IO, cast

from mcap.writer import CompressionType, IndexType, Writer

from compass_ros.episodes.definitions import Definition
from compass_ros.episodes.metadata import BagSummary, TopicCount, summary_text, write_summary
from compass_ros.errors import BagError

LIBRARY = "compass_ros"


class _RecordFile:
    """A file to which each write is made whole or not at all. Locked while open: nobody recovers it meanwhile."""

    def __init__(self, path: Path) -> None:
        self._descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o644)
        fcntl.flock(self._descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        self._end = 0

    def write(self, data: bytes) -> int:
        rest = memoryview(data)
        try:
            while rest:
                rest = rest[os.write(self._descriptor, rest) :]
        except OSError:
            os.ftruncate(self._descriptor, self._end)
            os.lseek(self._descriptor, self._end, os.SEEK_SET)
            raise
        self._end += len(data)
        return len(data)

    def tell(self) -> int:
        return self._end

    def close(self) -> None:
        os.close(self._descriptor)


def sync_bag(folder: Path) -> None:
    """Wait until a bag is on the disk, for the case of a power cut. Takes as long as the disk takes. Raises OSError."""
    for path in (*(file for file in folder.iterdir() if file.is_file()), folder):
        descriptor = os.open(path, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


class BagWriter:
    """One bag being written: FOLDER/NAME_0.mcap now, FOLDER/metadata.yaml when it is closed.

    The file's end and metadata.yaml are written by `close` only. Log times never decrease (readers rely on it): where
    the clock steps back the last log time is repeated, `clock_steps` counts it, the publish time stays as it was given.
    """

    def __init__(self, folder: Path, file_name: str = "") -> None:
        """Make the folder and open the bag in it. Raises BagError: the folder exists or cannot be made."""
        self.folder = folder
        self.path = folder / (file_name or f"{folder.name}_0.mcap")
        try:
            folder.mkdir(parents=True)
        except FileExistsError:
            raise BagError(f"{folder}: exists already; a bag is never written over") from None
        except OSError as error:
            raise BagError(f"{folder}: cannot be made: {error.strerror}") from error
        self.clock_steps = 0
        self._counts: dict[int, int] = {}
        self._topics: dict[int, TopicCount] = {}
        self._schemas: dict[tuple[str, str], int] = {}
        self._first_ns = 0
        self.last_ns = 0
        """Log time of the last message."""
        try:
            self._file = _RecordFile(self.path)
            self._mcap = Writer(
                cast(IO[bytes], self._file),
                compression=CompressionType.NONE,
                index_types=IndexType.METADATA,
                use_chunking=False,
                enable_data_crcs=True,
            )
            self._mcap.start(profile="ros2", library=LIBRARY)
        except OSError as error:
            raise BagError(f"{self.path}: cannot be written: {error.strerror}") from error

    @property
    def messages(self) -> int:
        """Messages in the bag so far."""
        return sum(self._counts.values())

    @property
    def duration_ns(self) -> int:
        """From the first message to the last, by log time."""
        return self.last_ns - self._first_ns

    def counts(self) -> dict[str, int]:
        """Messages by topic so far."""
        counts: dict[str, int] = {}
        for channel, topic in self._topics.items():
            counts[topic.name] = counts.get(topic.name, 0) + self._counts[channel]
        return counts

    def add_topic(self, name: str, definition: Definition, qos: str = "") -> int:
        """Declare a topic and get its channel. `qos`: the publishers' profiles as a YAML list, empty when not known."""
        key = (definition.type, definition.text)
        if key not in self._schemas:
            text = definition.text.encode()
            self._schemas[key] = self._mcap.register_schema(definition.type, definition.encoding, text)
        metadata = {"offered_qos_profiles": qos, "topic_type_hash": definition.digest}
        channel = self._mcap.register_channel(name, "cdr", self._schemas[key], metadata)
        self._topics[channel] = TopicCount(name, definition.type, definition.digest, 0, qos)
        self._counts[channel] = 0
        return channel

    def write(self, channel: int, log_ns: int, publish_ns: int, data: bytes) -> None:
        """Append one message, in the file when this returns. Raises BagError (disk full, ...)."""
        if not self.messages:
            self._first_ns = self.last_ns = log_ns
        elif log_ns < self.last_ns:
            self.clock_steps += 1
        self.last_ns = max(log_ns, self.last_ns)
        try:
            self._mcap.add_message(channel, self.last_ns, data, publish_ns, sequence=self._counts[channel])
        except OSError as error:
            raise BagError(f"{self.path}: {error.strerror} after {self.messages} messages") from error
        self._counts[channel] += 1

    def close(self) -> None:
        """Write the file's end and metadata.yaml: from here on the bag is whole. Raises BagError: then it is not."""
        summary = BagSummary(
            storage="mcap",
            files=(self.path.name,),
            start_ns=self._first_ns,
            duration_ns=self.duration_ns,
            messages=self.messages,
            topics=tuple(
                TopicCount(topic.name, topic.type, topic.digest, self._counts[channel], topic.qos)
                for channel, topic in self._topics.items()
            ),
        )
        try:
            self._mcap.add_metadata("rosbag2", {"serialized_metadata": summary_text(summary)})
            self._mcap.finish()  # type: ignore[no-untyped-call]
            write_summary(self.folder, summary)
        except OSError as error:
            raise BagError(f"{self.folder}: cannot be finished: {error.strerror}") from error
        finally:
            self._file.close()

    def abandon(self) -> None:
        """Let go of the file as it is, without an end: the bag is not whole and says so by having no metadata.yaml."""
        self._file.close()

    def delete(self) -> None:
        """Let go of the file and delete it and its folder. Raises BagError when the disk refuses."""
        self._file.close()
        try:
            self.path.unlink()
            self.folder.rmdir()
        except OSError as error:
            raise BagError(f"{self.folder}: cannot be deleted: {error.strerror}") from error

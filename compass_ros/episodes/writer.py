"""Crash-safe writing of a rosbag2 MCAP bag.

Every message is in the file as soon as it is written, also in a chunk that is not full (`chunks.py`). A process that
is killed loses nothing that it had written; what is left is a file without an end, in a folder without metadata.yaml,
which `recovery.recover` makes whole. A write that fails (disk full) is taken back: the file ends on a whole record.
"""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

from compass_ros.episodes.chunks import ChunkedFile
from compass_ros.episodes.definitions import Definition
from compass_ros.episodes.metadata import RECORD_KEY, RECORD_NAME, BagSummary, TopicCount, record_text, write_summary
from compass_ros.episodes.record_file import RecordFile
from compass_ros.errors import BagError

LIBRARY = "compass_ros"


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
        self._declared: dict[tuple[str, Definition], int] = {}
        self._schemas: dict[tuple[str, str], int] = {}
        self._first_ns = 0
        self.last_ns = 0
        """Log time of the last message."""
        try:
            self._file = RecordFile(self.path)
            self._mcap = ChunkedFile(self._file, LIBRARY)
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

    def add_topic(self, name: str, definition: Definition, qos: str = "", encoding: str = "cdr") -> int:
        """Declare a topic and get its channel; the same one, where it is declared already.

        Args:
            name: As in ROS, from the root.
            definition: Of its messages.
            qos: The publishers' profiles as a YAML list; empty when not known.
            encoding: How the messages are serialised: `cdr`, or `ros1` in bags of others.
        """
        declared = self._declared.get((name, definition))
        if declared is not None:
            return declared
        key = (definition.type, definition.text)
        if key not in self._schemas:
            text = definition.text.encode()
            self._schemas[key] = self._mcap.add_schema(definition.type, definition.encoding, text)
        metadata = {"offered_qos_profiles": qos, "topic_type_hash": definition.digest}
        channel = self._mcap.add_channel(name, self._schemas[key], encoding, metadata)
        self._topics[channel] = TopicCount(name, definition.type, definition.digest, 0, qos, encoding)
        self._declared[name, definition] = channel
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
            self._mcap.add_message(channel, self.last_ns, publish_ns, data)
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
            topics=tuple(replace(topic, messages=self._counts[channel]) for channel, topic in self._topics.items()),
        )
        try:
            self._mcap.finish(RECORD_NAME, {RECORD_KEY: record_text(summary)})
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

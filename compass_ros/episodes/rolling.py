"""The last seconds of all topics, kept in memory: a bag for whoever asks afterwards what has just happened."""

from __future__ import annotations

from collections import deque
from collections.abc import Generator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

from compass_ros.episodes.connection import Connection
from compass_ros.episodes.definitions import EPISODE_TYPE, embedded_definition
from compass_ros.episodes.latched import Latched
from compass_ros.episodes.notes import EPISODE_TOPIC, EpisodeHeader, header_bytes
from compass_ros.episodes.writer import BagWriter
from compass_ros.errors import BagError

BESIDE_DATA = 256
"""What Python holds beside the data of a message [bytes]: the head of its bytes (33), a tuple of five (80), three
numbers (32 each), a place in the queue (8), rounded up by the allocator; a test measures it."""


STEP_MESSAGES, STEP_BYTES = 200, 2**20
"""What is written in one step: some milliseconds, in which a recorder that goes on receiving is not missed."""


class Kept(NamedTuple):
    """One message."""

    connection: Connection
    log_ns: int
    publish_ns: int
    data: bytes
    lost: int
    """How many messages of the topic are missing before this one."""


@dataclass
class _Standing:
    """What a latched topic said before the oldest message that is kept."""

    connection: Connection
    said: Latched


class Rolling:
    """The messages of the last `span_ns`, in at most `most_bytes` of memory: the oldest go first.

    Beside them, of each latched topic, what stood when the oldest message came (`latched.MOST_BYTES` a topic).
    """

    def __init__(self, span_ns: int, most_bytes: int) -> None:
        self.span_ns = span_ns
        self.short = False
        """Whether the memory, and not the time, says how much is kept."""
        self._most_bytes = most_bytes
        self._bytes = 0
        self._messages: deque[Kept] = deque()
        self._connections: dict[str, Connection] = {}
        self._standing: dict[str, _Standing] = {}

    def __len__(self) -> int:
        """Messages that are kept."""
        return len(self._messages)

    @property
    def covered_ns(self) -> int:
        """From the oldest message to the newest."""
        return self._messages[-1].log_ns - self._messages[0].log_ns if self._messages else 0

    def connect(self, connection: Connection) -> None:
        """As `Recorder.connect`."""
        self._connections[connection.topic] = connection
        if not connection.latched:
            self._standing.pop(connection.topic, None)

    def keep(self, topic: str, log_ns: int, publish_ns: int, data: bytes, lost: int) -> None:
        """One message more of a connected topic."""
        self._messages.append(Kept(self._connections[topic], log_ns, publish_ns, data, lost))
        self._bytes += len(data) + BESIDE_DATA
        self._forget(log_ns)
        while self._bytes > self._most_bytes:
            self._drop()
            self.short = True

    def past(self, now_ns: int) -> Past:
        """What is kept now. Raises BagError: nothing."""
        self._forget(now_ns)
        if not self._messages:
            raise BagError(f"no message came in the last {self.span_ns * 1e-9:g} s")
        standing = [
            Kept(one.connection, 0, publish_ns, data, 0)
            for topic, one in self._standing.items()
            for data, publish_ns in one.said.standing(self._connections[topic].latched)
        ]
        return Past(tuple(standing), tuple(self._messages), tuple(self._connections.values()))

    def _forget(self, now_ns: int) -> None:
        """Let go of what is too old, or of another time: the clock was set back to before it."""
        while self._messages and not 0 <= now_ns - self._messages[0].log_ns <= self.span_ns:
            self._drop()
            self.short = False

    def _drop(self) -> None:
        old = self._messages.popleft()
        self._bytes -= len(old.data) + BESIDE_DATA
        topic = old.connection.topic
        if not self._connections[topic].latched or self._connections[topic].definition != old.connection.definition:
            return
        if topic not in self._standing or self._standing[topic].connection.definition != old.connection.definition:
            self._standing[topic] = _Standing(old.connection, Latched())
        self._standing[topic].said.keep(old.publish_ns, old.data)


@dataclass(frozen=True)
class Past:
    """The last seconds, as they were when somebody asked. To write them takes as long as the disk takes."""

    standing: tuple[Kept, ...]
    """What latched topics had said before; without a log time of their own."""
    messages: tuple[Kept, ...]
    """In the order in which they came; at least one."""
    connections: tuple[Connection, ...]

    def write(self, folder: Path, cell: str, cell_hash: str) -> EpisodeHeader:
        """As `writing`, in one go."""
        steps = self.writing(folder, cell, cell_hash)
        while True:
            try:
                next(steps)
            except StopIteration as end:
                said: EpisodeHeader = end.value
                return said

    def writing(self, folder: Path, cell: str, cell_hash: str) -> Generator[None, None, EpisodeHeader]:
        """Write an ordinary bag in steps and say what is in it. Raises BagError: it exists, or the disk refuses.

        A bag that could not be written whole is deleted: the operator asks again.
        """
        writer = BagWriter(folder)
        try:
            said = yield from self._written(writer, cell, cell_hash)
            writer.close()
        except BagError:
            writer.delete()
            raise
        return replace(said, bag=str(folder))

    def _written(self, writer: BagWriter, cell: str, cell_hash: str) -> Generator[None, None, EpisodeHeader]:
        start_ns = self.messages[0].log_ns
        topics = tuple(connection.topic for connection in self.connections)
        first = EpisodeHeader("recording", writer.folder.name, cell, cell_hash, start_ns, topics=topics)
        headers = writer.add_topic(EPISODE_TOPIC, embedded_definition(EPISODE_TYPE))
        for connection in self.connections:
            writer.add_topic(connection.topic, connection.definition, connection.qos)
        for one in self.standing:
            _write(writer, one._replace(log_ns=start_ns))
        writer.write(headers, start_ns, start_ns, header_bytes(first))
        size = 0
        for number, one in enumerate(self.messages, 1):
            _write(writer, one)
            size += len(one.data)
            if number % STEP_MESSAGES == 0 or size >= STEP_BYTES:
                size = 0
                yield
        last = replace(
            first,
            state="finished",
            duration_ns=writer.duration_ns,
            messages=writer.messages,
            message="; ".join(self._problems(writer)),
        )
        writer.write(headers, writer.last_ns, writer.last_ns, header_bytes(last))
        return last

    def _problems(self, writer: BagWriter) -> list[str]:
        lost: dict[str, int] = {}
        for one in self.messages:
            lost[one.connection.topic] = lost.get(one.connection.topic, 0) + one.lost
        said = [f"lost {count} messages on {topic}" for topic, count in sorted(lost.items()) if count]
        steps = writer.clock_steps
        return said + [f"the clock stepped back {steps} time{'s' * (steps != 1)}"] * bool(steps)


def _write(writer: BagWriter, one: Kept) -> None:
    connection = one.connection
    channel = writer.add_topic(connection.topic, connection.definition, connection.qos)
    writer.write(channel, one.log_ns, one.publish_ns, one.data)

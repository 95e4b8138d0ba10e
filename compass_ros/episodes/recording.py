"""Recording of episodes, one bag each, without ROS: bytes come in, a status goes out."""

from __future__ import annotations

import fcntl
import os
import shutil
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

from compass_ros.episodes.connection import Connection
from compass_ros.episodes.definitions import EPISODE_TYPE, SHOT_TYPE, embedded_definition
from compass_ros.episodes.latched import Latched
from compass_ros.episodes.names import episode_name, next_name
from compass_ros.episodes.notes import EPISODE_TOPIC, SHOT_TOPIC, EpisodeHeader, Shot, State, header_bytes, shot_bytes
from compass_ros.episodes.pulse import Pulse
from compass_ros.episodes.recovery import unfinished
from compass_ros.episodes.rolling import Past, Rolling
from compass_ros.episodes.writer import BagWriter
from compass_ros.errors import BagError

__all__ = ["LOCK_FILE", "Connection", "Recorder"]

LOCK_FILE = ".recorder.lock"


@cache
def _headers() -> Connection:
    return Connection(EPISODE_TOPIC, embedded_definition(EPISODE_TYPE))


@cache
def _shots() -> Connection:
    return Connection(SHOT_TOPIC, embedded_definition(SHOT_TYPE))


@dataclass
class _Losses:
    """What an episode did not get; by topic."""

    lost: dict[str, int] = field(default_factory=dict)
    heard: set[str] = field(default_factory=set)
    """Topics that have had a message: what is missing before the first was sent before the episode, or was not."""
    retyped: list[str] = field(default_factory=list)


class Recorder:
    """Writes one bag an episode into a folder that it holds alone.

    Times are the caller's [ns]. A write that fails ends the episode: its bag stays without an end and can be recovered.
    """

    def __init__(
        self, folder: Path, min_free_bytes: int = 0, max_duration_ns: int = 0, rolling: Rolling | None = None
    ) -> None:
        """Make the folder and take hold of it. `max_duration_ns`: an episode without an end is ended; 0: never.

        `rolling` keeps the last seconds, whether an episode runs or not.

        Raises BagError: the folder cannot be written, or another recorder holds it.
        """
        self.folder = folder.expanduser().absolute()
        """Bags are announced by paths in it, so they mean the same to whoever hears of them."""
        self._min_free_bytes = min_free_bytes
        self._max_duration_ns = max_duration_ns
        self._rolling = rolling
        self._lock = _hold(self.folder)
        self._connections: dict[str, Connection] = {}
        self._latched: dict[str, Latched] = {}
        self._sequences: dict[str, int] = {}
        self._writer: BagWriter | None = None
        self._losses = _Losses()
        self._pulse = Pulse()
        self._start_ns = 0
        self.status = EpisodeHeader(state="finished", episode="", message=self._unfinished())
        """What became of the last episode, or how the present one stands. No name: there was none yet."""

    @property
    def recording(self) -> bool:
        return self._writer is not None

    def free_bytes(self) -> int:
        """What the disk has left. Raises BagError when the folder is gone."""
        try:
            return shutil.disk_usage(self.folder).free
        except OSError as error:
            raise BagError(f"{self.folder}: {error.strerror}") from error

    def connect(self, connection: Connection) -> None:
        """A topic can be received now, has changed its type, or is latched by more publishers."""
        before = self._connections.get(connection.topic, connection)
        self._connections[connection.topic] = connection
        if self._rolling is not None:
            self._rolling.connect(connection)
        self._sequences.pop(connection.topic, None)
        changed = before.definition != connection.definition
        if changed or not connection.latched:
            self._latched.pop(connection.topic, None)
        if self._writer is not None:
            if changed:
                change = f"{connection.topic} changed from {before.definition.type} to {connection.definition.type}"
                self._losses.retyped.append(change)
            _declare(self._writer, connection)

    def start(self, name: str, cell: str, cell_hash: str, action: Mapping[str, float], now_ns: int) -> EpisodeHeader:
        """Begin an episode; an empty name is numbered. Raises BagError: one is running, bad name, no space, exists.

        Its bag begins with the latched messages that came before; the header (EpisodeInfo) comes after them.
        """
        if self._writer is not None:
            raise BagError(f"episode {self.status.episode} is being recorded; stop or discard it first")
        name = episode_name(name) if name else self._next("episode")
        self._check_space()
        writer = BagWriter(self.folder / name)
        self._writer, self._losses, self._start_ns = writer, _Losses(), now_ns
        self._pulse = Pulse()
        self.status = EpisodeHeader("recording", name, cell, cell_hash, now_ns, bag=str(writer.folder))
        for connection in (_headers(), *self._connections.values()):
            _declare(writer, connection)
        for topic, latched in self._latched.items():
            connection = self._connections[topic]
            for data, publish_ns in latched.standing(connection.latched):
                self._write(connection, now_ns, publish_ns, data)
        self._write(
            _headers(), now_ns, now_ns, header_bytes(replace(self.status, bag="", topics=tuple(self._connections)))
        )
        if action:
            self._write(_shots(), now_ns, now_ns, shot_bytes(Shot(now_ns, cell, action)))
        return self.progress()

    def take(self, topic: str, data: bytes, log_ns: int, publish_ns: int, sequence: int | None = None) -> None:
        """One message of a connected topic; between episodes it is kept for a while, or where it is latched.

        Args:
            sequence: The publisher's count of its messages, where the topic has one publisher: gaps are lost messages.

        Raises:
            BagError: The disk refuses; the episode is over and has failed.
        """
        connection = self._connections[topic]
        if connection.latched:
            self._latched.setdefault(topic, Latched()).keep(publish_ns, data)
        lost = self._missing(topic, sequence)
        if self._rolling is not None:
            self._rolling.keep(topic, log_ns, publish_ns, data, lost)
        if self._writer is None:
            return
        if lost and topic in self._losses.heard:
            self._losses.lost[topic] = self._losses.lost.get(topic, 0) + lost
        self._losses.heard.add(topic)
        self._pulse.beat(topic, log_ns)
        self._write(connection, log_ns, publish_ns, data)

    def last(self, now_ns: int) -> tuple[Path, Past]:
        """What `rolling` has kept, and the folder of the bag that is to hold it, which is not there yet.

        Raises BagError: nothing is kept, no space.
        """
        if self._rolling is None:
            raise BagError("the recorder keeps nothing between episodes")
        self._check_space()
        return self.folder / self._next("last"), self._rolling.past(now_ns)

    def overdue(self, now_ns: int) -> bool:
        """Whether the episode has lasted longer than it may."""
        return self.recording and 0 < self._max_duration_ns < now_ns - self._start_ns

    def stop(self, why: str = "", now_ns: int | None = None) -> EpisodeHeader:
        """End the episode and make its bag whole; at `now_ns`, or with its last message.

        What a person should know of the episode is in `message`: that it holds no data, what was lost, what stopped.
        Raises BagError: none is running, or the disk refuses.
        """
        writer = self._running()
        silent = self._silent(self._pulse.newest_ns if now_ns is None else now_ns)
        said = self._described("finished", "; ".join(filter(None, (why, self._empty(), *silent))))
        self._write(_headers(), writer.last_ns, writer.last_ns, header_bytes(replace(said, bag="")))
        try:
            writer.close()
        except BagError as error:
            self._fail(error)
            raise
        self._writer = None
        self.status = said
        return said

    def discard(self) -> EpisodeHeader:
        """Delete the bag of the present episode, which ends, or of the last one, once.

        Raises BagError: there is none, or the disk refuses.
        """
        if self._writer is None:
            self._delete_last()
        else:
            writer, self.status = self._writer, self._described("discarded")
            self._writer = None
            writer.delete()
        return self.status

    def _delete_last(self) -> None:
        if not self.status.bag or self.status.state not in ("finished", "failed"):
            raise BagError("no episode is being recorded, and there is no last one to discard")
        try:
            shutil.rmtree(self.status.bag)
        except OSError as error:
            raise BagError(f"{self.status.bag}: cannot be deleted: {error.strerror}") from error
        self.status = replace(self.status, state="discarded", message="")

    def close(self) -> None:
        """Let go of the folder. An episode that is still running stays without an end and can be recovered."""
        if self._writer is not None:
            self._fail(BagError("the recorder was stopped in the middle of the episode"))
        os.close(self._lock)

    def progress(self) -> EpisodeHeader:
        """The status now, with what was counted so far."""
        if self.recording:
            self.status = self._described("recording")
        return self.status

    def counts(self) -> dict[str, int]:
        """Messages of the present episode by topic."""
        return self._writer.counts() if self._writer is not None else {}

    @property
    def lost(self) -> int:
        """Messages that the present (or last) episode did not get."""
        return sum(self._losses.lost.values())

    def problems(self) -> tuple[str, ...]:
        """What went wrong in the present (or last) episode, one sentence each."""
        lost = [f"lost {count} messages on {topic}" for topic, count in sorted(self._losses.lost.items())]
        steps = self._writer.clock_steps if self._writer is not None else 0
        stepped = [f"the clock stepped back {steps} time{'s' * (steps != 1)}"] if steps else []
        return (*lost, *self._losses.retyped, *stepped)

    def _check_space(self) -> None:
        free = self.free_bytes()
        if free < self._min_free_bytes:
            raise BagError(f"{self.folder}: {free / 1e6:.0f} MB left; expected {self._min_free_bytes / 1e6:.0f} MB")

    def _next(self, stem: str) -> str:
        return next_name((path.name for path in self.folder.glob("*")), stem)

    def _missing(self, topic: str, sequence: int | None) -> int:
        """How many messages are missing between the one before and this one, by their publisher's count."""
        if sequence is None:
            return 0
        before = self._sequences.get(topic, sequence - 1)
        self._sequences[topic] = sequence
        return max(sequence - before - 1, 0)

    def _silent(self, end_ns: int) -> list[str]:
        return [f"{topic} stopped {s:.1f} s before the end" for topic, s in self._pulse.stopped(end_ns).items()]

    def _empty(self) -> str:
        if self._pulse:
            return ""
        topics = len(self._connections)
        return f"no data: no message came on {'any of its topics' if topics else 'any topic, none has a publisher'}"

    def _running(self) -> BagWriter:
        if self._writer is None:
            last = f" (episode {self.status.episode} failed: {self.status.message})" * (self.status.state == "failed")
            raise BagError(f"no episode is being recorded{last}")
        return self._writer

    def _write(self, connection: Connection, log_ns: int, publish_ns: int, data: bytes) -> None:
        try:
            writer = self._running()
            writer.write(_declare(writer, connection), log_ns, publish_ns, data)
        except BagError as error:
            self._fail(error)
            raise

    def _fail(self, error: BagError) -> None:
        writer = self._running()
        message = f"{error}; run: compass record --recover {writer.folder}"
        self.status = self._described("failed", message)
        self._writer = None
        writer.abandon()

    def _described(self, state: State, message: str = "") -> EpisodeHeader:
        """The status of the present episode, with what was counted so far."""
        writer = self._running()
        return replace(
            self.status,
            state=state,
            duration_ns=writer.duration_ns,
            messages=writer.messages,
            topics=tuple(self._connections),
            message="; ".join(filter(None, (message, *self.problems()))),
        )

    def _unfinished(self) -> str:
        found = unfinished(self.folder)
        if not found:
            return ""
        names = ", ".join(path.name for path in found)
        return f"bags without an end: {names}; run: compass record --recover {self.folder}"


def _declare(writer: BagWriter, connection: Connection) -> int:
    return writer.add_topic(connection.topic, connection.definition, connection.qos)


def _hold(folder: Path) -> int:
    """Make a folder and lock it for this process; the lock falls when the process ends, however it ends."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        descriptor = os.open(folder / LOCK_FILE, os.O_RDWR | os.O_CREAT, 0o644)
    except OSError as error:
        raise BagError(f"{folder}: cannot be written: {error.strerror}") from error
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        holder = os.read(descriptor, 20).decode(errors="replace") or "unknown"
        os.close(descriptor)
        raise BagError(
            f"{folder}: another recorder (process {holder}) records here; give each its own folder"
        ) from None
    os.ftruncate(descriptor, 0)
    os.write(descriptor, str(os.getpid()).encode())
    return descriptor

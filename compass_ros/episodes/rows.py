"""Messages of a topic as rows of numbers: thousands at once, in the order in which they came."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from compass_ros.episodes.columns import Columns
from compass_ros.episodes.layout import Bytes, Fields, Layout, alike, layout, matrix
from compass_ros.episodes.messages import KINDS, columns, entries, readable
from compass_ros.episodes.raw import RawMessage, RawTopic
from compass_ros.episodes.schemas import fields_of
from compass_ros.episodes.sources import Source
from compass_ros.errors import BagError
from compass_ros.types import Bools, Floats, Ints

BATCH = 1024
"""Messages that are read at once: beyond some hundreds the work per message is that of the bytes alone."""
BATCH_BYTES = 4 * 2**20
"""The same in bytes, so that large messages do not fill the memory."""


class Stream(NamedTuple):
    """What is told apart on one topic."""

    frame: str
    """Frame of the positions."""
    publisher: str
    """As far as the bag says it."""


@dataclass(frozen=True)
class Rows:
    """Rows of one source."""

    stamp_ns: Ints
    """(n,) when it was measured, or is to be reached; by the log time where the message does not say."""
    begin_ns: Ints
    """(n,) when the message begins to hold: of a point of a trajectory earlier than its stamp, else the same."""
    log_ns: Ints
    """(n,) when the message was recorded."""
    stamped: Bools
    """(n,) whether the message says its time itself."""
    value: Floats
    """(n, D); NaN: the message lacks the number."""
    std: Floats
    """(n,) standard deviation of the position [m]; 0: not stated."""


class TopicReader:
    """Collects the messages of a topic and gives the rows of its sources."""

    def __init__(self, topic: RawTopic, sources: Sequence[Source]) -> None:
        """Raises BagError where the topic's messages can be read for one of its sources in no case."""
        for source in sources:
            if not readable(topic.type, source):
                raise BagError(f"{topic.name} is a {topic.type}; expected one of {', '.join(sorted(KINDS))}")
        self.topic = topic
        self._sources = sources
        with _named(topic):
            self._fields: Fields = fields_of(topic)
        self._data: list[bytes] = []
        self._log: list[int] = []
        self._size = 0
        self.entries: set[str] = set()
        """What its messages call the things that they hold."""
        self._found: dict[Source, dict[Stream, list[Rows]]] = {}

    def take(self, message: RawMessage) -> None:
        """One message more. Raises BagError where it, or one before it, cannot be understood."""
        self._data.append(message.data)
        self._log.append(message.log_ns)
        self._size += len(message.data)
        if len(self._data) >= BATCH or self._size >= BATCH_BYTES:
            self._flush()

    def taken(self) -> dict[Source, dict[Stream, list[Rows]]]:
        """The rows since this was called before. Raises BagError."""
        if self._data:
            self._flush()
        found, self._found = self._found, {}
        return found

    def _flush(self) -> None:
        """Read what was collected."""
        log = np.array(self._log, np.int64)
        pieces: dict[tuple[Source, Stream], list[tuple[Ints, Rows]]] = {}
        for own, messages, alike_in in self._layouts():
            self.entries.update(entries(alike_in, self.topic.type))
            for source in self._sources:
                for found in columns(alike_in, self.topic.type, source):
                    stream = Stream(found.frame, f"{self.topic.publisher} {found.publisher}")
                    rows = _rows(alike_in, messages, found, log[own])
                    pieces.setdefault((source, stream), []).append((own, rows))
        for (source, stream), parts in pieces.items():
            self._found.setdefault(source, {}).setdefault(stream, []).append(_in_order(parts))
        self._data, self._log, self._size = [], [], 0

    def _layouts(self) -> Iterator[tuple[Ints, Bytes, Layout]]:
        """Messages laid out alike: which they are, (n, size) their bytes, the layout."""
        sizes = np.array([len(data) for data in self._data])
        for size in np.unique(sizes):
            own = np.flatnonzero(sizes == size)
            messages = matrix([self._data[i] for i in own])
            while len(own):
                with _named(self.topic):
                    found = layout(self._fields, self.topic.type, self._data[own[0]], self.topic.ros1)
                same = alike(messages, 0, found.fixed)
                yield own[same], messages[same], found
                own, messages = own[~same], messages[~same]


@contextmanager
def _named(topic: RawTopic) -> Iterator[None]:
    """A BagError says on which topic it was."""
    try:
        yield
    except BagError as error:
        raise BagError(f"{topic.name}: {error}") from error


def joined(parts: Sequence[Rows]) -> Rows:
    """Rows one after the other."""
    stamp = np.concatenate([part.stamp_ns for part in parts])
    once = all(part.begin_ns is part.stamp_ns for part in parts)
    return Rows(
        stamp,
        stamp if once else np.concatenate([part.begin_ns for part in parts]),
        np.concatenate([part.log_ns for part in parts]),
        np.concatenate([part.stamped for part in parts]),
        np.concatenate([part.value for part in parts]),
        np.concatenate([part.std for part in parts]),
    )


def chosen(rows: Rows, which: Ints | Bools) -> Rows:
    """Some of them, in the order asked for; the rows themselves where all are."""
    if which.dtype == bool and which.all():
        return rows
    stamp = rows.stamp_ns[which]
    begin = stamp if rows.begin_ns is rows.stamp_ns else rows.begin_ns[which]
    return Rows(stamp, begin, rows.log_ns[which], rows.stamped[which], rows.value[which], rows.std[which])


def _in_order(parts: Sequence[tuple[Ints, Rows]]) -> Rows:
    """Rows of several layouts in the order of their messages; those of one message in their own."""
    if len(parts) == 1:
        return parts[0][1]
    which = np.concatenate([own for own, _ in parts])
    return chosen(joined([rows for _, rows in parts]), np.argsort(which, kind="stable"))


def _rows(found: Layout, messages: Bytes, one: Columns, log: Ints) -> Rows:
    value = np.full((len(messages), len(one.numbers)), np.nan)
    for place, number in enumerate(one.numbers):
        if number is not None:
            value[:, place] = found.number(messages, *number)
    if one.unknown:
        value[found.number(messages, one.unknown) == -1] = np.nan
    stamp = _nanoseconds(found, messages, f"{one.header}.stamp") if one.header else np.zeros(len(messages), np.int64)
    stamped = stamp != 0
    begin = np.where(stamped, stamp, log)
    at = begin + _nanoseconds(found, messages, one.since) if one.since else begin
    return Rows(at, begin, log, stamped, value, _std(found, messages, one.covariance))


def _nanoseconds(found: Layout, messages: Bytes, path: str) -> Ints:
    seconds, rest = (found.integer(messages, f"{path}.{part}") for part in ("sec", "nanosec"))
    return np.asarray(seconds * 10**9 + rest, np.int64)


def _std(found: Layout, messages: Bytes, path: str) -> Floats:
    """(n,) in the plane, from a 6 x 6 row-major covariance; 0 where it states none (0 or negative)."""
    if not path or found.count(path) != 36:
        return np.zeros(len(messages))
    variance = (found.number(messages, path, 0) + found.number(messages, path, 7)) / 2
    return np.asarray(np.sqrt(np.where(variance <= 0, 0.0, variance)))

"""A bag becomes an episode, or a BagError with one line: which file, what was expected, what was found."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from compass_ros.episodes.bag import RawMessage, RawTopic, Remark, bag_name, decode, is_bag, scan
from compass_ros.episodes.clocks import on_one_clock
from compass_ros.episodes.definitions import EPISODE_TYPES, SHOT_TYPES, STRING_TYPE
from compass_ros.episodes.messages import KINDS
from compass_ros.episodes.notes import (
    EPISODE_TOPIC,
    NOTES_TOPIC,
    SHOT_TOPIC,
    EpisodeHeader,
    Notes,
    Shot,
    header,
    noted_as,
    notes,
    shot,
)
from compass_ros.episodes.rows import Rows, Stream, TopicReader, joined
from compass_ros.episodes.sources import Source
from compass_ros.episodes.tracks import tracks
from compass_ros.errors import BagError, nearest
from compass_ros.types import Episode, Track

Hashes = str | tuple[str, ...]
"""Of the configuration in which a bag was recorded: of the cell itself, then of others whose bags are its own too."""
Streams = dict[Source, dict[Stream, Rows]]

EARLY_SHOT_NS = 10**9
"""A shot stamped longer than this before the start of its recording belongs to an earlier episode [ns]."""


@dataclass(frozen=True)
class TopicSummary:
    """One topic of a bag."""

    name: str
    type: str
    messages: int
    known: bool
    """Whether its messages can be read: tracks, the shot, the episode's header and notes. Others are left alone."""


@dataclass(frozen=True)
class BagContent:
    """An episode and what else its bag holds."""

    episode: Episode
    topics: tuple[TopicSummary, ...]
    """All topics, by name."""


def list_topics(path: str | Path) -> tuple[TopicSummary, ...]:
    """All topics of a bag, by name. Raises BagError."""
    counts: dict[RawTopic, int] = {}
    for item in scan(Path(path)):
        _count(counts, item)
    return _summaries(counts)


def find_bags(paths: Iterable[str | Path]) -> tuple[Path, ...]:
    """The bags that paths name: bags as they are; a folder of bags stands for all in it (not deeper). Each bag once.

    Raises BagError for a path that is neither, and where there is no bag at all.
    """
    found: dict[Path, Path] = {}
    for path in map(Path, paths):
        bags = [path] if is_bag(path) or not path.is_dir() else _bags_in(path)
        if not bags:
            raise BagError(f"{path}: no episodes: expected a bag or a folder of bags")
        for bag in bags:
            found.setdefault(bag.resolve(), bag)
    if not found:
        raise BagError("no episodes: expected at least one bag, found none")
    return tuple(found.values())


def _bags_in(folder: Path) -> list[Path]:
    """Hidden ones are none: macOS leaves `._x.mcap` beside x.mcap, and a recovery works in a hidden folder."""
    return sorted(path for path in folder.iterdir() if is_bag(path) and not path.name.startswith("."))


def read_episodes(
    paths: Iterable[str | Path], sources: Sequence[Source], cell: str = "", cell_hash: Hashes = ""
) -> tuple[Episode, ...]:
    """Read bags (or folders of bags) given in any order; sorted by name, then start. Raises BagError."""
    episodes = [read_episode(path, sources, cell, cell_hash) for path in find_bags(paths)]
    return tuple(sorted(episodes, key=lambda episode: (episode.name, episode.start_ns, episode.source)))


def read_episode(path: str | Path, sources: Sequence[Source], cell: str = "", cell_hash: Hashes = "") -> Episode:
    """Read one bag. Shorthand for `read_bag(...).episode`."""
    return read_bag(path, sources, cell, cell_hash).episode


def read_bag(path: str | Path, sources: Sequence[Source], cell: str = "", cell_hash: Hashes = "") -> BagContent:
    """Read one bag.

    Args:
        path: A bag's folder or file.
        sources: Where the tracks come from, one each; each must have messages.
        cell, cell_hash: What the bag must have been recorded in (any of several hashes); empty: anything. A bag that
            does not say (a foreign one) passes and gets the name `cell` and an empty hash.

    Raises:
        BagError: The bag is missing, empty, truncated, foreign, of another cell, without a wanted topic, with more than
            one shot, without one usable measurement of an object, or with stamps out of order.
    """
    path = Path(path)
    content = _Content(sources)
    for item in scan(path):
        _count(content.counts, item)
        if isinstance(item, Remark):
            content.remarks.append(item.text)
        elif isinstance(item, RawMessage):
            with _named(path):
                content.take(item)
    with _named(path):
        return BagContent(_episode(path, content, cell, cell_hash), _summaries(content.counts))


@contextmanager
def _named(path: Path) -> Iterator[None]:
    """A BagError says in which bag it was."""
    try:
        yield
    except BagError as error:
        raise BagError(f"{path}: {error}") from error


class _Content:
    """What one pass over a bag collects."""

    def __init__(self, sources: Sequence[Source]) -> None:
        self.sources = sources
        self.counts: dict[RawTopic, int] = {}
        self.latched: Streams = {}
        """Rows from before the episode: all there is of an object whose pose was published once."""
        self.headers: list[EpisodeHeader] = []
        self.shots: list[tuple[str, Shot]] = []
        self.entries: dict[str, set[str]] = {}
        """By topic: what the messages call the things that they hold."""
        self.notes = Notes()
        self.remarks: list[str] = []
        """On the bag's files."""
        self._readers: dict[int, tuple[RawTopic, TopicReader | None]] = {}
        """By the topic's identity, which no other has while it is kept; None: nobody asks for it."""
        self._types: dict[str, str] = {}

    def take(self, message: RawMessage) -> None:
        """Raises BagError."""
        topic = message.topic
        if topic.ros1:
            pass  # our own messages are ROS 2 ones
        elif topic.name == EPISODE_TOPIC and topic.type in EPISODE_TYPES:
            if not self.headers:
                self._begin()
            self.headers.append(header(decode(message)))
        elif topic.type in SHOT_TYPES:
            self.shots.append((topic.name, shot(decode(message))))
        elif (topic.name, topic.type) == (NOTES_TOPIC, STRING_TYPE):
            self.notes = notes(decode(message))
        if id(topic) not in self._readers:
            self._readers[id(topic)] = topic, self._reader(topic)
        _, reader = self._readers[id(topic)]
        if reader is not None:
            reader.take(message)

    def streams(self) -> Streams:
        """The rows collected so far, by source; they are let go of. Raises BagError."""
        found: dict[Source, dict[Stream, list[Rows]]] = {}
        for _, reader in self._readers.values():
            if reader is not None:
                for source, streams in reader.taken().items():
                    for stream, rows in streams.items():
                        found.setdefault(source, {}).setdefault(stream, []).extend(rows)
                self.entries.setdefault(reader.topic.name, set()).update(reader.entries)
        # Each is let go of as it is joined, so that the rows are held once.
        return {s: {stream: joined(found[s].pop(stream)) for stream in [*found[s]]} for s in found}

    def _reader(self, topic: RawTopic) -> TopicReader | None:
        own = [source for source in self.sources if source.topic == topic.name]
        if not own:
            return None
        if self._types.setdefault(topic.name, topic.type) != topic.type:
            raise BagError(f"{topic.name} changes from {self._types[topic.name]} to {topic.type} in this bag")
        return TopicReader(topic, own)

    def _begin(self) -> None:
        """What stands before the first header is latched: it came before the episode and is no sample of its motion."""
        self.latched = self.streams()
        self.shots.clear()


def _episode(path: Path, content: _Content, cell: str, cell_hash: Hashes) -> Episode:
    streams = content.streams()
    head = content.headers[0] if content.headers else EpisodeHeader("finished", bag_name(path))
    if cell and head.cell and head.cell != cell:
        raise BagError(f"recorded in another cell: expected '{cell}', found '{head.cell}'; name its own cell")
    known = (cell_hash,) if isinstance(cell_hash, str) else cell_hash
    if known[0] and head.cell_hash and head.cell_hash not in known:
        raise BagError(
            f"recorded in another '{cell}': expected configuration {known[0]}, found {head.cell_hash}; where topics "
            f"and sensors are the same, say `recorded_as: ['{head.cell_hash}']` in the cell"
        )
    rows = {source: streams.get(source) or content.latched.get(source, {}) for source in content.sources}
    aligned, clocks = on_one_clock(rows)
    found = {source: _tracks(source, aligned[source], content) for source in content.sources}
    own = [made for source, (made, _) in found.items() if not source.drives]
    fired = _fired(content.shots, head)
    first_ns = min((int(track.stamp_ns[0]) for track, *_ in own), default=0)
    said = (remark for _, remarks in found.values() for remark in remarks)
    return Episode(
        name=head.episode or bag_name(path),
        cell=head.cell or cell,
        cell_hash=head.cell_hash,
        action=fired.action if fired else {},
        start_ns=fired.stamp_ns if fired else head.start_ns or first_ns,
        tracks=tuple(track for track, *_ in own),
        initial_state=content.notes.initial_state,
        source=str(path),
        others=tuple(track for _, *others in own for track in others),
        remarks=(*content.remarks, *content.notes.remarks, *clocks, *said),
        inputs=tuple(track for source, ((track, *_), _) in found.items() if source.drives),
    )


def _fired(shots: Sequence[tuple[str, Shot]], head: EpisodeHeader) -> Shot | None:
    """The one shot of an episode: a robot's own message before the operator's (SHOT_TOPIC), no earlier episode's."""
    own = [found for topic, found in shots if topic != SHOT_TOPIC] or [found for _, found in shots]
    recent = [found for found in own if found.stamp_ns >= head.start_ns - EARLY_SHOT_NS] or own
    stamps = sorted({found.stamp_ns for found in recent})
    if len(stamps) > 1:
        seconds = ", ".join(f"{stamp * 1e-9:.3f}" for stamp in stamps[:4])
        raise BagError(f"expected one shot an episode, found {len(stamps)} (at {seconds} s)")
    return recent[0] if recent else None


def _tracks(source: Source, streams: Mapping[Stream, Rows], content: _Content) -> tuple[list[Track], list[str]]:
    """As `tracks.tracks`; raises BagError also where the source, or one of its numbers, never comes."""
    if not streams:
        raise BagError(_no_messages(source, source.wanted, content))
    made, said = tracks(source, streams, content.notes.std.get(noted_as(source)))
    never = [name for name, values in zip(source.of, made[0].value.T, strict=False) if np.isnan(values).all()]
    if never:
        raise BagError(_no_messages(source, never, content))
    return made, said


def _no_messages(source: Source, wanted: Sequence[str], content: _Content) -> str:
    names = sorted({topic.name for topic in content.counts})
    if source.topic not in names:
        known = f"it has {_some(names)}" if names else "it has no topics"
        return f"no topic {source.topic} for {source.object}; {known}{nearest(source.topic, names)}"
    others = sorted(content.entries.get(source.topic, ()))
    held = [name for name in wanted if name in others]
    if held:
        return f"{source.topic} names '{held[0]}', but holds no '{source.quantity}' of it"
    named = source.entry or source.of or source.quantity == "joint"
    what = f" of {', '.join(map(repr, wanted))}" if named else ""
    there = f"; there are {_some(others)}{nearest(wanted[0], others)}" if others else ""
    return f"no messages{what} on {source.topic} ({source.object} was never seen){there}"


def _some(names: Sequence[str]) -> str:
    return f"{', '.join(names[:12])}{', ...' * (len(names) > 12)}"


def _count(counts: dict[RawTopic, int], item: RawTopic | RawMessage | Remark) -> None:
    if isinstance(item, RawMessage):
        counts[item.topic] += 1
    elif isinstance(item, RawTopic):
        counts.setdefault(item, 0)


def _summaries(counts: Mapping[RawTopic, int]) -> tuple[TopicSummary, ...]:
    known = KINDS.keys() | EPISODE_TYPES | SHOT_TYPES
    return tuple(
        TopicSummary(topic.name, topic.type, count, topic.type in known or topic.name == NOTES_TOPIC)
        for topic, count in sorted(counts.items(), key=lambda item: (item[0].name, item[0].type))
    )

"""A bag becomes an episode, or a BagError with one line: which file, what was expected, what was found."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from compass_ros.episodes.bag import RawMessage, RawTopic, Remark, bag_name, decode, is_bag, scan
from compass_ros.episodes.definitions import EPISODE_TYPES, SHOT_TYPES, STRING_TYPE
from compass_ros.episodes.measured import left_out, measured
from compass_ros.episodes.notes import NOTES_TOPIC, SHOT_TOPIC, EpisodeHeader, Notes, Shot, header, notes, shot
from compass_ros.episodes.sources import KNOWN_TYPES, Row, Source, entries, plain_frame, rows
from compass_ros.errors import BagError, nearest
from compass_ros.types import Episode, Floats, Track

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
    paths: Iterable[str | Path], sources: Sequence[Source], cell: str = "", cell_hash: str = ""
) -> tuple[Episode, ...]:
    """Read bags (or folders of bags) given in any order; sorted by name, then start. Raises BagError."""
    episodes = [read_episode(path, sources, cell, cell_hash) for path in find_bags(paths)]
    return tuple(sorted(episodes, key=lambda episode: (episode.name, episode.start_ns, episode.source)))


def read_episode(path: str | Path, sources: Sequence[Source], cell: str = "", cell_hash: str = "") -> Episode:
    """Read one bag. Shorthand for `read_bag(...).episode`."""
    return read_bag(path, sources, cell, cell_hash).episode


def read_bag(path: str | Path, sources: Sequence[Source], cell: str = "", cell_hash: str = "") -> BagContent:
    """Read one bag.

    Args:
        path: A bag's folder or file.
        sources: Where the tracks come from, one each; each must have messages.
        cell, cell_hash: What the bag must have been recorded in; empty: anything. A bag that does not say (a foreign
            one) passes and gets the name `cell` and an empty hash.

    Raises:
        BagError: The bag is missing, empty, truncated, foreign, of another cell, without a wanted topic, with more than
            one shot, without one usable measurement of an object, or with stamps out of order.
    """
    path = Path(path)
    content = _Content({source: [] for source in sources})
    for item in scan(path):
        _count(content.counts, item)
        if isinstance(item, Remark):
            content.remarks.append(item.text)
        elif isinstance(item, RawMessage):
            try:
                content.take(item)
            except BagError as error:
                raise BagError(f"{path}: {error}") from error
    try:
        return BagContent(_episode(path, content, cell, cell_hash), _summaries(content.counts))
    except BagError as error:
        raise BagError(f"{path}: {error}") from error


class _Content:
    """What one pass over a bag collects."""

    def __init__(self, tracks: dict[Source, list[Row]]) -> None:
        self.tracks = tracks
        self.counts: dict[RawTopic, int] = {}
        self.latched: dict[Source, list[Row]] = {}
        """Rows from before the episode: all there is of an object whose pose was published once."""
        self.headers: list[EpisodeHeader] = []
        self.shots: list[tuple[str, Shot]] = []
        self.others: dict[Source, set[str]] = {}
        """Joints or frames of messages on a source's topic that do not hold it."""
        self.notes = Notes()
        self.remarks: list[str] = []
        """On the bag's files."""
        self._by_topic: dict[str, list[Source]] = {}
        self._types: dict[str, str] = {}
        for source in tracks:
            self._by_topic.setdefault(source.topic, []).append(source)

    def take(self, message: RawMessage) -> None:
        topic = message.topic
        if topic.ros1:
            pass  # our own messages are ROS 2 ones
        elif topic.type in EPISODE_TYPES:
            if not self.headers:
                self._begin()
            self.headers.append(header(decode(message)))
        elif topic.type in SHOT_TYPES:
            self.shots.append((topic.name, shot(decode(message))))
        elif (topic.name, topic.type) == (NOTES_TOPIC, STRING_TYPE):
            self.notes = notes(decode(message))
        for source in self._by_topic.get(topic.name, ()):
            if self._types.setdefault(topic.name, topic.type) != topic.type:
                raise BagError(f"{topic.name} changes from {self._types[topic.name]} to {topic.type} in this bag")
            if topic.type not in KNOWN_TYPES:
                raise BagError(f"{topic.name} is a {topic.type}; expected one of {', '.join(sorted(KNOWN_TYPES))}")
            decoded = decode(message)
            found = list(rows(decoded, topic.type, source))
            if not found:
                self.others.setdefault(source, set()).update(entries(decoded, topic.type))
            self.tracks[source] += found

    def _begin(self) -> None:
        """What stands before the first header is latched: it came before the episode and is no sample of its motion."""
        self.latched = {source: found for source, found in self.tracks.items() if found}
        self.tracks = {source: [] for source in self.tracks}
        self.shots.clear()


def _episode(path: Path, content: _Content, cell: str, cell_hash: str) -> Episode:
    head = content.headers[0] if content.headers else EpisodeHeader("finished", bag_name(path))
    if cell and head.cell and head.cell != cell:
        raise BagError(f"recorded in another cell: expected '{cell}', found '{head.cell}'")
    if cell_hash and head.cell_hash and head.cell_hash != cell_hash:
        raise BagError(f"recorded in another '{cell}': expected configuration {cell_hash}, found {head.cell_hash}")
    latched = content.latched
    found = [_tracks(source, rows or latched.get(source, []), content) for source, rows in content.tracks.items()]
    tracks = tuple(track for (track, *_), _ in found)
    fired = _fired(content.shots, head)
    first_ns = min((int(track.stamp_ns[0]) for track in tracks), default=0)
    return Episode(
        name=head.episode or bag_name(path),
        cell=head.cell or cell,
        cell_hash=head.cell_hash,
        action=fired.action if fired else {},
        start_ns=fired.stamp_ns if fired else head.start_ns or first_ns,
        tracks=tracks,
        initial_state=content.notes.initial_state,
        source=str(path),
        others=tuple(track for (_, *others), _ in found for track in others),
        remarks=(*content.remarks, *content.notes.remarks, *(remark for _, said in found for remark in said)),
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


def _tracks(source: Source, found: Sequence[Row], content: _Content) -> tuple[tuple[Track, ...], list[str]]:
    """The tracks of one object, one for each frame it is seen in, the one to use first; and what there is to say."""
    if not found:
        raise BagError(_no_messages(source, content))
    frames: dict[str, list[Row]] = {}
    for row in found:
        frames.setdefault(row.frame, []).append(row)
    ordered = sorted(frames, key=lambda name: len(frames[name]), reverse=True)
    if source.frame:
        wanted = plain_frame(source.frame)
        if wanted not in frames:
            raise BagError(
                f"{source.topic}: {source.object} is not seen in the frame '{wanted}', but in {_some(ordered)}"
            )
        ordered.sort(key=lambda name: name != wanted)
    tracks, remarks = zip(*(_track(source, frames[name], content) for name in ordered), strict=True)
    said = [remark for remark in remarks[:1] if remark]
    if len(frames) > 1 and not source.frame:
        counts = ", ".join(f"'{name}' ({len(frames[name])} messages)" for name in ordered)
        where = f"{source.object} is seen on {source.topic} in {len(frames)} frames, {counts}"
        said.append(f"{where}: only '{ordered[0]}' is used; `frame` in the cell's YAML names another")
    return tracks, said


def _track(source: Source, found: Sequence[Row], content: _Content) -> tuple[Track, str]:
    """Track of the rows of one frame, and what was left out of it."""
    every = np.array([row.value for row in found], float)
    kept = measured(every, source.quantity)
    remark = left_out(every, source.quantity, f"messages of {source.object} on {source.topic}")
    if not kept.any():
        unset = source.quantity == "pose" and bool(np.isfinite(every).all())
        hint = "; its positions alone are usable: `quantity: xyz`" if unset else ""
        raise BagError(f"{remark}: nothing is left of {source.object}{hint}")
    used = [row for row, use in zip(found, kept, strict=True) if use]
    once = [row for index, row in enumerate(used) if index == 0 or row != used[index - 1]]
    stamps = np.array([row.stamp_ns for row in once], np.int64)
    backwards = np.flatnonzero(np.diff(stamps) <= 0)
    if backwards.size:
        index = int(backwards[0]) + 1
        step = int(stamps[index] - stamps[index - 1])
        how = f"{-step} ns before the one before it" if step else "as is the one before it"
        where = f"message {index + 1} of {source.object} is stamped {stamps[index]} ns, {how}"
        raise BagError(f"{source.topic}: stamps out of order: {where}")
    values = np.array([row.value for row in once], float)
    std = _std(once, source, content.notes)
    return Track(source.object, source.quantity, stamps, values, std, once[0].frame), remark


def _std(found: Sequence[Row], source: Source, said: Notes) -> Floats | None:
    stated = [row.std for row in found if row.std is not None]
    if len(stated) < len(found):
        noted = said.std.get(source.object)
        if noted is None:
            return None
        stated = list(noted) if len(noted) == len(found) else [noted[0]] * len(found)
    bad = np.flatnonzero(~np.isfinite(stated))
    if bad.size:
        which = f"message {bad[0] + 1} ({bad.size} of {len(stated)} messages): {stated[bad[0]]}"
        raise BagError(f"{source.topic}: standard deviation of {source.object} is not finite in {which}")
    return np.array(stated)


def _no_messages(source: Source, content: _Content) -> str:
    names = sorted({topic.name for topic in content.counts})
    if source.topic in names:
        wanted, others = source.entry or source.object, sorted(content.others.get(source, ()))
        what = f" of '{wanted}'" if source.entry or source.quantity == "joint" else ""
        there = f"; there are {_some(others)}{nearest(wanted, others)}" if others else ""
        if wanted in others:
            return f"{source.topic} names '{wanted}', but holds no '{source.quantity}' of it"
        return f"no messages{what} on {source.topic} ({source.object} was never seen){there}"
    known = f"it has {_some(names)}" if names else "it has no topics"
    return f"no topic {source.topic} for {source.object}; {known}{nearest(source.topic, names)}"


def _some(names: Sequence[str]) -> str:
    return f"{', '.join(names[:12])}{', ...' * (len(names) > 12)}"


def _count(counts: dict[RawTopic, int], item: RawTopic | RawMessage | Remark) -> None:
    if isinstance(item, RawMessage):
        counts[item.topic] += 1
    elif isinstance(item, RawTopic):
        counts.setdefault(item, 0)


def _summaries(counts: Mapping[RawTopic, int]) -> tuple[TopicSummary, ...]:
    known = KNOWN_TYPES | EPISODE_TYPES | SHOT_TYPES
    return tuple(
        TopicSummary(topic.name, topic.type, count, topic.type in known or topic.name == NOTES_TOPIC)
        for topic, count in sorted(counts.items(), key=lambda item: (item[0].name, item[0].type))
    )

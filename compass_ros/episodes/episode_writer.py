"""An episode becomes a bag, without ROS. The same episode gives the same bytes on every machine."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from compass_ros.episodes.definitions import EPISODE_TYPE, POSE_TYPE, SHOT_TYPE, STRING_TYPE, embedded_definition
from compass_ros.episodes.joint_messages import JOINT_FIELDS
from compass_ros.episodes.names import episode_name
from compass_ros.episodes.notes import (
    EPISODE_TOPIC,
    NOTES_TOPIC,
    EpisodeHeader,
    Notes,
    Shot,
    header_bytes,
    noted_as,
    notes_bytes,
    shot_bytes,
)
from compass_ros.episodes.sources import Source, default_topic
from compass_ros.episodes.track_messages import Written, joint_messages, message_type, messages
from compass_ros.episodes.writer import BagWriter
from compass_ros.errors import BagError
from compass_ros.types import QUANTITY_SIZE, Episode, Track

SHOT_OUT_TOPIC = "/virtual_cell/shot"


def write_episode(episode: Episode, folder: str | Path, sources: Sequence[Source] = ()) -> Path:
    """Write the bag FOLDER/NAME and return its path. `reader.read_episode` gives the same episode back, bit for bit.

    Args:
        episode: What to write; `source` is not kept.
        folder: Where the bag's folder is made.
        sources: Topics of tracks and inputs, and the names of joints and numbers; default: `default_topic`, and the
            track's own name for its one number.

    Raises:
        BagError: The name cannot be a folder's, the folder exists or cannot be written, a stamp does not fit, or a
            track has another number of columns than its source has names.
    """
    written = _with_sources(episode, sources)
    every = sorted(_messages(written), key=lambda message: message.stamp_ns)
    types = {EPISODE_TOPIC: EPISODE_TYPE, NOTES_TOPIC: STRING_TYPE, SHOT_OUT_TOPIC: SHOT_TYPE}
    for track, source in written:
        kind = message_type(track.quantity)
        if types.setdefault(source.topic, kind) != kind:
            raise BagError(
                f"{track.object}: {source.topic} holds {types[source.topic]}; a {track.quantity} needs {kind}"
            )
    start_ns = min([episode.start_ns, *(message.stamp_ns for message in every[:1])])
    first = [
        Written(start_ns, EPISODE_TOPIC, header_bytes(_header(episode, tuple(types), every))),
        Written(start_ns, NOTES_TOPIC, notes_bytes(_notes(episode, written))),
        Written(start_ns, SHOT_OUT_TOPIC, shot_bytes(Shot(episode.start_ns, episode.cell, episode.action))),
    ]
    writer = BagWriter(Path(folder) / episode_name(episode.name))
    channels = {topic: writer.add_topic(topic, embedded_definition(kind)) for topic, kind in types.items()}
    try:
        for message in [*first, *every]:
            writer.write(channels[message.topic], message.stamp_ns, message.stamp_ns, message.data)
    except BagError:
        writer.abandon()
        raise
    writer.close()
    return writer.folder


def _with_sources(episode: Episode, sources: Sequence[Source]) -> list[tuple[Track, Source]]:
    """Each track and input with its source. Raises BagError where names of its numbers are missing."""
    found = {(source.object, source.drives): source for source in sources}
    out: list[tuple[Track, Source]] = []
    for track, drives in [*((t, False) for t in episode.tracks), *((t, True) for t in episode.inputs)]:
        topic = default_topic(track.object, track.quantity, drives)
        source = found.get((track.object, drives), Source(topic, track.object, track.quantity, drives=drives))
        size = QUANTITY_SIZE[track.quantity] if not source.of or source.quantity == "joint" else len(source.of)
        if track.value.shape[1:] != (size,):
            what = f"{track.object}: a {track.quantity} with {track.value.shape[1]} numbers"
            raise BagError(f"{what}; expected {size}, as its source has it ({', '.join(source.wanted)})")
        out.append((track, source))
    return out


def _messages(written: Sequence[tuple[Track, Source]]) -> Iterator[Written]:
    """Positions, velocities and efforts of the same joints on one topic share their messages."""
    joints: dict[tuple[str, tuple[str, ...]], list[dict[str, tuple[Track, Source]]]] = {}
    for track, source in written:
        if track.quantity not in JOINT_FIELDS:
            yield from messages(track, source)
            continue
        groups, field = joints.setdefault((source.topic, source.wanted), []), JOINT_FIELDS[track.quantity]
        if not groups or field in groups[-1]:
            groups.append({})
        groups[-1][field] = track, source
    for groups in joints.values():
        for group in groups:
            yield from joint_messages([*group.values()])


def _header(episode: Episode, topics: tuple[str, ...], written: Sequence[Written]) -> EpisodeHeader:
    return EpisodeHeader(
        state="finished",
        episode=episode.name,
        cell=episode.cell,
        cell_hash=episode.cell_hash,
        start_ns=episode.start_ns,
        duration_ns=max(written[-1].stamp_ns - episode.start_ns, 0) if written else 0,
        messages=len(written),
        topics=topics,
    )


def _notes(episode: Episode, written: Sequence[tuple[Track, Source]]) -> Notes:
    """Initial state, remarks, and the standard deviations that only the messages of poses have room for."""
    std = {
        noted_as(source): tuple(track.std.tolist())
        for track, source in written
        if track.std is not None and message_type(track.quantity) != POSE_TYPE
    }
    return Notes(episode.initial_state, std, episode.remarks)

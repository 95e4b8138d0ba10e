"""An episode becomes a bag, without ROS. The same episode gives the same bytes on every machine."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rosbags.typesys.stores import ros2_jazzy as ros

from compass_ros.episodes.definitions import (
    EPISODE_TYPE,
    JOINT_TYPE,
    POSE_TYPE,
    SHOT_TYPE,
    STRING_TYPE,
    embedded_definition,
)
from compass_ros.episodes.names import episode_name
from compass_ros.episodes.notes import (
    EPISODE_TOPIC,
    NOTES_TOPIC,
    EpisodeHeader,
    Notes,
    Shot,
    encoded,
    header_bytes,
    notes_bytes,
    shot_bytes,
    stamped,
)
from compass_ros.episodes.sources import Source, default_sources
from compass_ros.episodes.writer import BagWriter
from compass_ros.errors import BagError
from compass_ros.types import Episode, Floats, Track

SHOT_OUT_TOPIC = "/virtual_cell/shot"
FRAME = "table"


def write_episode(episode: Episode, folder: str | Path, sources: Sequence[Source] = ()) -> Path:
    """Write the bag FOLDER/NAME and return its path. `reader.read_episode` gives the same episode back, bit for bit.

    Args:
        episode: What to write; `source` is not kept.
        folder: Where the bag's folder is made.
        sources: Topics of the tracks; default: `default_sources` for each track's object and quantity.

    Raises:
        BagError: The name cannot be a folder's, the folder exists or cannot be written, or a stamp does not fit.
    """
    found = {source.object: source for source in sources}
    for track in episode.tracks:
        found.setdefault(track.object, default_sources([track.object], track.quantity)[0])
    messages = sorted(
        (message for track in episode.tracks for message in _track_messages(track, found[track.object])),
        key=lambda message: message[0],
    )
    types = {EPISODE_TOPIC: EPISODE_TYPE, NOTES_TOPIC: STRING_TYPE, SHOT_OUT_TOPIC: SHOT_TYPE}
    types |= {found[track.object].topic: _message_type(track) for track in episode.tracks}
    start_ns = min([episode.start_ns, *(stamp for stamp, _, _ in messages[:1])])
    first = [
        (start_ns, EPISODE_TOPIC, header_bytes(_header(episode, tuple(types), messages))),
        (start_ns, NOTES_TOPIC, notes_bytes(_notes(episode))),
        (start_ns, SHOT_OUT_TOPIC, shot_bytes(Shot(episode.start_ns, episode.cell, episode.action))),
    ]
    writer = BagWriter(Path(folder) / episode_name(episode.name))
    channels = {topic: writer.add_topic(topic, embedded_definition(kind)) for topic, kind in types.items()}
    try:
        for stamp_ns, topic, data in [*first, *messages]:
            writer.write(channels[topic], stamp_ns, stamp_ns, data)
    except BagError:
        writer.abandon()
        raise
    writer.close()
    return writer.folder


def _header(episode: Episode, topics: tuple[str, ...], messages: Sequence[tuple[int, str, bytes]]) -> EpisodeHeader:
    return EpisodeHeader(
        state="finished",
        episode=episode.name,
        cell=episode.cell,
        cell_hash=episode.cell_hash,
        start_ns=episode.start_ns,
        duration_ns=max(messages[-1][0] - episode.start_ns, 0) if messages else 0,
        messages=len(messages),
        topics=topics,
    )


def _notes(episode: Episode) -> Notes:
    """Initial state, remarks, and the standard deviations that JointState has no room for."""
    std = {t.object: tuple(t.std.tolist()) for t in episode.tracks if t.quantity == "joint" and t.std is not None}
    return Notes(episode.initial_state, std, episode.remarks)


def _message_type(track: Track) -> str:
    return JOINT_TYPE if track.quantity == "joint" else POSE_TYPE


def _track_messages(track: Track, source: Source) -> list[tuple[int, str, bytes]]:
    """(stamp [ns], topic, CDR) of each row."""
    std = track.std if track.std is not None else np.zeros(len(track.stamp_ns))
    kind = _message_type(track)
    make = _joint_state if track.quantity == "joint" else _pose
    return [
        (int(stamp), source.topic, encoded(make(int(stamp), source, value, float(sigma)), kind))
        for stamp, value, sigma in zip(track.stamp_ns, track.value, std, strict=True)
    ]


def _joint_state(stamp_ns: int, source: Source, value: Floats, std: float) -> object:
    none = np.zeros(0)
    name = source.entry or source.object
    return ros.sensor_msgs__msg__JointState(stamped(stamp_ns), [name], np.asarray(value, float), none, none)


def _pose(stamp_ns: int, source: Source, value: Floats, std: float) -> object:
    """Position, and the identity where the row has no orientation; the covariance holds std^2 for x, y (and z)."""
    numbers = [float(number) for number in value]
    x, y, z = (*numbers[:3], 0.0)[:3]
    w, qx, qy, qz = numbers[3:] if len(numbers) == 7 else (1.0, 0.0, 0.0, 0.0)
    covariance = np.zeros((6, 6))
    covariance[[0, 1, 2], [0, 1, 2]] = std**2
    pose = ros.geometry_msgs__msg__Pose(
        ros.geometry_msgs__msg__Point(x, y, z), ros.geometry_msgs__msg__Quaternion(qx, qy, qz, w)
    )
    stated = ros.geometry_msgs__msg__PoseWithCovariance(pose, covariance.ravel())
    return ros.geometry_msgs__msg__PoseWithCovarianceStamped(stamped(stamp_ns, FRAME), stated)

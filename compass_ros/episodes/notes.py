"""What a bag says of an episode beside its tracks: header (EpisodeInfo), shot (ShotCommand), notes (JSON in String)."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Literal, Protocol, cast

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, ValidationError
from rosbags.typesys.stores import ros2_jazzy as ros

from compass_ros.episodes.definitions import EPISODE_TYPE, SHOT_TYPE, STRING_TYPE, typestore
from compass_ros.episodes.sources import Source
from compass_ros.errors import BagError

EPISODE_TOPIC = "/compass/episode"
"""EpisodeInfo: first with the state `recording`, last with what became of the episode."""
SHOT_TOPIC = "/compass/shot"
"""ShotCommand written by the recorder from its start service; a shot that a robot's node publishes goes before it."""
NOTES_TOPIC = "/compass/notes"
"""std_msgs/String with JSON, see `Notes`."""

State = Literal["recording", "finished", "discarded", "recovered", "failed"]
STATES: tuple[State, ...] = ("recording", "finished", "discarded", "recovered", "failed")
"""EpisodeInfo's states in the order of their numbers."""

MOST_STAMP_NS = 2**31 * 10**9
"""Stamps are seconds in an int32: this many nanoseconds do not fit any more."""


@dataclass(frozen=True)
class EpisodeHeader:
    """The fields of EpisodeInfo."""

    state: State
    episode: str
    cell: str = ""
    cell_hash: str = ""
    start_ns: int = 0
    """When the recording began, in the clock of the stamps; 0: not known."""
    duration_ns: int = 0
    messages: int = 0
    topics: tuple[str, ...] = ()
    bag: str = ""
    """The bag's path; empty inside a bag, which may be moved."""
    message: str = ""
    """What a person should know: messages lost, the disk full, how to recover."""


@dataclass(frozen=True)
class Shot:
    """The fields of ShotCommand."""

    stamp_ns: int
    """When the motion began, in the clock of the stamps."""
    cell: str
    action: Mapping[str, float]


@dataclass(frozen=True)
class Notes:
    """What no message of an episode has room for."""

    initial_state: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    """First state by object, where the cell does not fix it."""
    std: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    """By `noted_as`: a standard deviation for each row, or one for all; where messages cannot state it."""
    remarks: tuple[str, ...] = ()
    """What the import of a table left out."""


class _NotesContent(BaseModel):
    """The JSON of `Notes`."""

    model_config = ConfigDict(extra="ignore")
    initial_state: dict[str, tuple[FiniteFloat, ...]] = {}
    std: dict[str, Annotated[tuple[FiniteFloat, ...], Field(min_length=1)]] = {}
    remarks: tuple[str, ...] = ()


class _ShotMessage(Protocol):
    header: ros.std_msgs__msg__Header
    cell: str
    names: list[str]
    values: NDArray[np.float64]


class _EpisodeMessage(Protocol):
    header: ros.std_msgs__msg__Header
    state: int
    episode: str
    cell: str
    cell_hash: str
    bag: str
    duration: ros.builtin_interfaces__msg__Duration
    messages: int
    topics: list[str]
    message: str


def noted_as(source: Source) -> str:
    """What the notes call a source: an input may have the name of a signal."""
    return f"input {source.object}" if source.drives else source.object


def header(message: object) -> EpisodeHeader:
    """From a deserialised EpisodeInfo. Raises BagError for a state that is not known."""
    info = cast(_EpisodeMessage, message)
    if info.state >= len(STATES):
        raise BagError(f"{EPISODE_TOPIC}: expected a state below {len(STATES)}, found {info.state}")
    return EpisodeHeader(
        state=STATES[info.state],
        episode=info.episode,
        cell=info.cell,
        cell_hash=info.cell_hash,
        start_ns=stamp_ns(info.header.stamp),
        duration_ns=stamp_ns(info.duration),
        messages=info.messages,
        topics=tuple(info.topics),
        bag=info.bag,
        message=info.message,
    )


def shot(message: object) -> Shot:
    """From a deserialised ShotCommand. Raises BagError where names and values do not fit or a value is not finite."""
    command = cast(_ShotMessage, message)
    names, values = list(command.names), np.asarray(command.values, float)
    if len(names) != len(values) or len(set(names)) != len(names):
        raise BagError(f"a shot has {len(values)} values for the names {names}; expected one each")
    if not np.isfinite(values).all():
        raise BagError(f"a shot has values that are not finite: {dict(zip(names, values.tolist(), strict=True))}")
    return Shot(stamp_ns(command.header.stamp), command.cell, dict(zip(names, values.tolist(), strict=True)))


def notes(message: object) -> Notes:
    """From a deserialised std_msgs/String. Raises BagError where it is not the JSON of notes."""
    text = cast(ros.std_msgs__msg__String, message).data
    try:
        content = _NotesContent.model_validate_json(text)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise BagError(f"{NOTES_TOPIC}: not the notes of an episode: {where}: {first['msg']}") from error
    return Notes(content.initial_state, content.std, content.remarks)


def stamp_ns(stamp: ros.builtin_interfaces__msg__Time | ros.builtin_interfaces__msg__Duration) -> int:
    """Nanoseconds of a stamp or duration."""
    return int(stamp.sec) * 10**9 + int(stamp.nanosec)


def stamped(at_ns: int, frame: str = "") -> ros.std_msgs__msg__Header:
    """A header. Raises BagError for a time that a stamp cannot hold."""
    if not 0 <= at_ns < MOST_STAMP_NS:
        raise BagError(f"a stamp of {at_ns} ns does not fit a ROS header; expected 0 to {MOST_STAMP_NS} ns")
    return ros.std_msgs__msg__Header(ros.builtin_interfaces__msg__Time(at_ns // 10**9, at_ns % 10**9), frame)


def header_bytes(info: EpisodeHeader) -> bytes:
    """EpisodeInfo in CDR."""
    message = typestore().types[EPISODE_TYPE](
        header=stamped(info.start_ns),
        state=STATES.index(info.state),
        episode=info.episode,
        cell=info.cell,
        cell_hash=info.cell_hash,
        bag=info.bag,
        duration=ros.builtin_interfaces__msg__Duration(info.duration_ns // 10**9, info.duration_ns % 10**9),
        messages=info.messages,
        topics=list(info.topics),
        message=info.message,
    )
    return encoded(message, EPISODE_TYPE)


def shot_bytes(command: Shot) -> bytes:
    """ShotCommand in CDR."""
    message = typestore().types[SHOT_TYPE](
        header=stamped(command.stamp_ns),
        cell=command.cell,
        names=list(command.action),
        values=np.array(list(command.action.values()), np.float64),
    )
    return encoded(message, SHOT_TYPE)


def notes_bytes(said: Notes) -> bytes:
    """Notes as std_msgs/String in CDR; the same notes give the same bytes."""
    content: dict[str, object] = {"initial_state": _plain(said.initial_state), "std": _plain(said.std)}
    if said.remarks:
        content["remarks"] = list(said.remarks)
    return encoded(ros.std_msgs__msg__String(json.dumps(content, sort_keys=True)), STRING_TYPE)


def encoded(message: object, type_name: str) -> bytes:
    """A message in little-endian CDR."""
    return bytes(typestore().serialize_cdr(message, type_name, little_endian=True))


def _plain(numbers: Mapping[str, Sequence[float]]) -> Mapping[str, list[float]]:
    return {name: [float(number) for number in values] for name, values in numbers.items()}

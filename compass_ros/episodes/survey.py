"""What a bag's topics hold, before anybody says what is wanted of them: joints, frames, quantities."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import get_args

from compass_ros.episodes.bag import RawMessage, RawTopic, scan
from compass_ros.episodes.layout import Layout, layout
from compass_ros.episodes.messages import KINDS, columns, entries
from compass_ros.episodes.schemas import fields_of
from compass_ros.episodes.sources import Part, Source
from compass_ros.errors import BagError
from compass_ros.types import Quantity

LOOKED_AT = 400
"""Messages of a topic that are looked at: joints that are published in turns have come by then."""
_QUANTITIES: tuple[Quantity, ...] = (
    "joint_position",
    "joint_velocity",
    "joint_effort",
    "pose",
    "position",
    "wrench",
    "gyro",
    "accelerometer",
)
_LISTS = "data"


@dataclass(frozen=True)
class Held:
    """One thing that a topic holds."""

    topic: str
    type: str
    quantity: Quantity
    names: tuple[str, ...]
    """Joints or the frame, as the messages call them; of numbers without names their places, from 0."""
    named: bool
    part: Part = "feedback"

    def source(self, name: str, drives: bool = False) -> Source:
        """Where it is read from. A pose is of one thing, and what it is called is its `entry`."""
        if self.quantity.startswith("joint"):
            return Source(self.topic, name, self.quantity, of=self.names, part=self.part, drives=drives)
        return Source(self.topic, name, self.quantity, entry=self.names[0] if self.named else "", drives=drives)


def survey(path: Path) -> tuple[Held, ...]:
    """What can be read of a bag, by topic. Raises BagError for a bag that cannot be read at all."""
    seen: dict[RawTopic, list[bytes]] = {}
    for item in scan(path):
        if isinstance(item, RawMessage):
            kept = seen.setdefault(item.topic, [])
            if item.topic.type in KINDS and len(kept) < LOOKED_AT:
                kept.append(item.data)
    found: dict[tuple[str, str, Quantity, Part], Held] = {}
    for topic, messages in sorted(seen.items(), key=lambda one: one[0].name):
        for held in _held(topic, messages):
            key = (held.topic, "" if held.quantity.startswith("joint") else held.names[0], held.quantity, held.part)
            before = found.get(key, held)
            found[key] = replace(held, names=tuple(dict.fromkeys([*before.names, *held.names])))
    return tuple(found.values())


def _held(topic: RawTopic, messages: list[bytes]) -> Iterator[Held]:
    """What the messages of one topic hold, one after the other."""
    if not messages:
        return
    try:
        fields = fields_of(topic)
        layouts = [layout(fields, topic.type, data, topic.ros1) for data in dict.fromkeys(messages)]
    except BagError:  # a topic that nobody can read is nobody's: it is not listed
        return
    for one in layouts:
        for quantity in _QUANTITIES:
            for part in get_args(Part) if "ControllerState" in topic.type or "DOF" in topic.type else ("feedback",):
                yield from _in_message(topic, one, quantity, part)


def _in_message(topic: RawTopic, one: Layout, quantity: Quantity, part: Part) -> Iterator[Held]:
    named = tuple(dict.fromkeys(name.removeprefix("/") for name in entries(one, topic.type) if name))
    names = named or tuple(str(i) for i in range(one.count(_LISTS))) or (topic.name,)
    joints = quantity.startswith("joint")
    for of in [names] if joints else [(name,) for name in names]:
        held = Held(topic.name, topic.type, quantity, of, bool(named), part)
        try:
            numbers = [c.numbers for c in columns(one, topic.type, held.source("any"))]
        except BagError:  # such a message never holds that quantity
            continue
        present = tuple(n for n, *at in zip(of, *numbers, strict=True) if any(at)) if joints else of
        if numbers and present:
            yield replace(held, names=present)

"""Where the tracks and inputs of an episode come from: topics of a bag, and what of their messages."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from compass_ros.types import Quantity

Part = Literal["reference", "feedback", "output"]
"""What a controller was asked for, what it measured, what it put out."""


@dataclass(frozen=True)
class Source:
    """Which messages make up one track, or one input."""

    topic: str
    object: str
    """Name of the object, signal or input."""
    quantity: Quantity = "xy"
    entry: str = ""
    """TFMessage, TransformStamped: the child frame; a sensor's message: its frame; JointState: the joint's name, where
    `of` has none. Empty: the object's name, except for TransformStamped and sensors, where it is any frame."""
    frame: str = ""
    """Positions: those in this frame (`header.frame_id`) make up the track; empty: the one with most messages."""
    of: tuple[str, ...] = ()
    """Joints by their names in the messages; the numbers of a pose, twist or wrench that are wanted; names of numbers
    that have none (Float64MultiArray), in their order; in messages of other types, paths of numbers (`motors[2].q`)."""
    part: Part = "feedback"
    """Which part of a controller's state."""
    drives: bool = False
    """It is an input."""

    @property
    def wanted(self) -> tuple[str, ...]:
        """(D,) what the numbers of a row are called in a message that names them."""
        return self.of or (self.entry or self.object,)


def default_topic(name: str, quantity: Quantity, drives: bool = False) -> str:
    """Where an object, signal or input is, if nobody says it: where tracker, robots and import put it."""
    if quantity in ("joint", "joint_position", "joint_velocity", "joint_effort"):
        return "/joint_commands" if drives else "/joint_states"
    tracked = quantity in ("xy", "xyz", "pose", "position") and not drives
    return f"/puck_tracker/{name}/pose" if tracked else f"/{name}"


def default_sources(objects: Sequence[str], quantity: Quantity = "xy") -> tuple[Source, ...]:
    """Tracks of objects on their default topics."""
    return tuple(Source(default_topic(name, quantity), name, quantity) for name in objects)

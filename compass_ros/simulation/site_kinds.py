"""Kinds of site by name, and what they are called in a result and in messages."""

from __future__ import annotations

from collections.abc import Collection
from typing import Literal

from compass_ros.types import SiteWord

SiteKind = Literal[
    "hinge",
    "slide",
    "table",
    "lying",
    "planar",
    "body",
    "wall",
    "contacts",
    "geom_pair",
    "body_pair",
    "tool_drive",
    "velocity_drive",
    "position_drive",
    "effort_drive",
    "other_drive",
    "camera",
    "encoder",
    "sensor",
    "field",
]
"""hinge, slide: a joint with one degree of freedom. planar: a body that slides along x and y of the world (and may turn
about z); lying: one that gravity presses on what it slides on; table: one whose friction there is the cell's. body: any
other moving body. wall: a fixed geom in a pair. contacts: all of the scene. geom_pair: two geoms that may touch;
body_pair: two bodies of which one moves, or both. velocity_drive, position_drive,
effort_drive, other_drive: an actuator by what it is told; tool_drive: velocity drives that move one tool along x and y
of the world (and z), whose command is a vector. camera: tracked bodies as they are seen; encoder: what is measured of
joints; sensor: other signals; each all of them, one by its name, or one of its numbers as `signal.number`. field: a
number of the scene, `object@type@field`."""

JOINTS: tuple[SiteKind, ...] = ("hinge", "slide")
LYING: tuple[SiteKind, ...] = ("table", "lying")
PLANAR: tuple[SiteKind, ...] = (*LYING, "planar")
MOVING: tuple[SiteKind, ...] = (*JOINTS, *PLANAR, "body")
SPEED_DRIVES: tuple[SiteKind, ...] = ("tool_drive", "velocity_drive")
SINGLE_DRIVES: tuple[SiteKind, ...] = ("velocity_drive", "position_drive", "effort_drive", "other_drive")
DRIVES: tuple[SiteKind, ...] = ("tool_drive", *SINGLE_DRIVES)
SIGNALS: tuple[SiteKind, ...] = ("camera", "encoder", "sensor")
PAIRS: tuple[SiteKind, ...] = ("geom_pair", "body_pair")

_WORDS: dict[SiteKind, str] = {
    "table": "body on the cell's table",
    "lying": "body that lies on a plane",
    "planar": "body that slides in a plane",
    "body": "moving body",
    "wall": "fixed geom in a contact pair",
    "contacts": "geoms that could touch",
    "geom_pair": "two geoms",
    "body_pair": "two bodies",
    "camera": "tracked body",
    "encoder": "measured joint",
    "sensor": "other sensor",
    "field": "number",
}


def word_of(kind: SiteKind) -> SiteWord:
    """What a result calls it."""
    if kind in JOINTS:
        return "joint"
    if kind in MOVING:
        return "body"
    if kind in DRIVES:
        return "actuator"
    if kind in SIGNALS:
        return "signal"
    if kind == "field":
        return "field"
    return "body_pair" if kind == "body_pair" else "geom_pair"


def in_words(kinds: Collection[SiteKind]) -> str:
    """Kinds of site as a message names them: 'hinge or slide'."""
    if set(kinds) >= set(MOVING):
        return "joint or moving body"
    if set(kinds) >= set(DRIVES):
        return "drive"
    if set(kinds) >= set(SINGLE_DRIVES):
        return "drive of one actuator"
    wider = [k for k in kinds if not (k in LYING and "planar" in kinds) and not (k == "table" and "lying" in kinds)]
    return " or ".join(_WORDS.get(kind, kind.replace("_", " ")) for kind in wider)

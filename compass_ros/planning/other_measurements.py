"""What tells explanations apart that no shot and no motion does: another measurement, by the channels of their laws."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Literal

from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import EFFECTS
from compass_ros.simulation.sites import any_slides

_ENCODERS = "record the arm's own position too, by its encoders: a late command shows there, a late camera does not"
_GRID = "put a puck at rest on nine known points of the table: the camera's errors show there, forces do not"
_FAN_OFF = "repeat a shot with the air or the fan off, and with the launch line turned by 180 degrees"
_ALONE = "repeat a shot with one object alone on the table"
_SLOW = "film one bounce at several speeds with a faster camera"
_TABLE: Mapping[frozenset[str], str] = MappingProxyType(
    {
        frozenset({"sensing", "actuation"}): _ENCODERS,
        frozenset({"sensing", "dynamics"}): _GRID,
        frozenset({"sensing", "contact"}): _GRID,
        frozenset({"sensing"}): _GRID,
        frozenset({"actuation"}): _ENCODERS,
        frozenset({"actuation", "dynamics"}): _ENCODERS,
        frozenset({"actuation", "contact"}): _ENCODERS,
        frozenset({"dynamics"}): _FAN_OFF,
        frozenset({"dynamics", "contact"}): _ALONE,
        frozenset({"contact"}): _SLOW,
    }
)
"""Where something slides in a plane."""
_ONE_CLOCK = "record the commands and the encoders with stamps of one clock, and a fast step of the command"
_OTHER_SPEED = "repeat the motions at a third of their speed and at three times that, and from other places"
_ONE_AT_A_TIME = "move one joint at a time, the others held"
_SECOND = "measure the same motion with a second sensor, from another place: what it shows as well is motion"
_ELSEWHERE: Mapping[frozenset[str], str] = MappingProxyType(
    {
        frozenset({"dynamics"}): _OTHER_SPEED,
        frozenset({"dynamics", "contact"}): "repeat the motions where nothing is touched",
        frozenset({"contact"}): "film one touch at several speeds with a fast camera",
    }
)
Moved = Literal["flat", "driven", "free"]
"""Whether something slides in a plane; else whether it is commanded."""
_OF: Mapping[Moved, Mapping[frozenset[str], str]] = MappingProxyType(
    {
        "flat": _TABLE,
        "driven": {**dict.fromkeys(_TABLE, _ONE_CLOCK), **_ELSEWHERE},
        "free": {**dict.fromkeys(_TABLE, _SECOND), **_ELSEWHERE},
    }
)


def how_moved(simulator: Simulator) -> Moved:
    """How what is recorded comes to move."""
    if any_slides(simulator.moving):
        return "flat"
    return "driven" if simulator.cell.action or simulator.cell.spec.inputs else "free"


def between(one: frozenset[str], other: frozenset[str], moved: Moved) -> str:
    """What to do where explanations with these names of laws are open."""
    names = one ^ other
    if not names:  # the same laws on other sites
        return {"flat": _ALONE, "driven": _ONE_AT_A_TIME, "free": _OTHER_SPEED}[moved]
    channels = sorted({str(EFFECTS[name].channel) for name in names})
    return _OF[moved][frozenset(channels[-2:])]


def of_unknown(channel: str, moved: Moved) -> str:
    """What to do where something is left that no law explains, in a channel or in `all`."""
    return _OF[moved][frozenset({"dynamics" if channel == "all" else channel})]

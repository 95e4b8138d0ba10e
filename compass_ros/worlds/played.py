"""What a real cell hands back for commands: what happened, and what was recorded of it."""

from __future__ import annotations

from dataclasses import dataclass, field

from compass_ros.types import Episode, Floats


@dataclass(frozen=True)
class Played:
    """S shots, C numbers that are tracked."""

    time_s: Floats
    """(F,) control steps since the command."""
    seen: Floats
    """(S, F, C) what the tracker would say without noise [m]."""
    episodes: tuple[Episode, ...] = field(repr=False)
    """As the tracker has recorded them, with the commands that were sent."""

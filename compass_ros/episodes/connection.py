"""A topic that is being received."""

from __future__ import annotations

from dataclasses import dataclass

from compass_ros.episodes.definitions import Definition


@dataclass(frozen=True)
class Connection:
    """A topic that is received, with the type that it has now."""

    topic: str
    definition: Definition
    qos: str = ""
    """The publishers' QoS profiles as a YAML list."""
    latched: int = 0
    """Publishers seen so far that keep their last messages for whoever comes later; 0: the topic is not latched."""

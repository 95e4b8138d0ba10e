"""Topics that are asked for by a shell pattern: what fits it now, and what comes later."""

from __future__ import annotations

import re
from dataclasses import dataclass
from fnmatch import fnmatchcase

from rclpy.topic_or_service_is_hidden import topic_or_service_is_hidden

_WILD = re.compile(r"\[[^\]/]+\]|[*?]")
"""What stands for letters: any number of them, one, or one of some."""


@dataclass(frozen=True)
class TopicPattern:
    """Of names from the root. `*` stands for any letters, also for `/`: `/arm/*` is all below `/arm`."""

    text: str
    """From the root."""
    below: str = ""
    """The namespace that the bag leaves out of the names; empty where the pattern was given from the root."""

    def matches(self, topic: str) -> bool:
        """Hidden topics (a part begins with `_`, as those of actions) only where the pattern says so itself."""
        hidden = topic_or_service_is_hidden(topic) and not topic_or_service_is_hidden(self.text)
        return fnmatchcase(topic, self.text) and not hidden

    def recorded(self, topic: str) -> str:
        """The name in the bag of a topic that matches."""
        return topic.removeprefix(self.below)


def is_pattern(given: str) -> bool:
    """Whether what was given for a topic stands for several."""
    return _WILD.search(given) is not None


def topic_pattern(given: str, namespace: str) -> TopicPattern:
    """A pattern as an operator writes it; a relative one is in the namespace of the node."""
    below = namespace.rstrip("/")
    return TopicPattern(given) if given.startswith("/") else TopicPattern(f"{below}/{given}", below)


def example(given: str) -> str:
    """A name that a pattern matches, for checks of its other letters."""
    return _WILD.sub("x", given)

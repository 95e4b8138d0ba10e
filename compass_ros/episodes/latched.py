"""Latched messages: what a subscriber that comes now would still get from the publishers of a topic, kept by us.

A message does not say who published it. Of a topic with one publisher the last message stands; of one with several
(`/tf_static`) every different one, since each publisher says something else and says it once.
"""

from __future__ import annotations

MOST_BYTES = 4 * 2**20
"""Of different messages on one topic; the newest is kept at any size. Robot descriptions have up to some 100 kB, static
transforms less than one."""


class Latched:
    """The messages of one latched topic, before and between episodes."""

    def __init__(self) -> None:
        self._published_ns: dict[bytes, int] = {}
        """Message -> when it was published; the newest last."""
        self._bytes = 0

    def keep(self, publish_ns: int, data: bytes) -> None:
        """A message came. One that came before stands as the newest now."""
        if self._published_ns.pop(data, None) is None:
            self._bytes += len(data)
        self._published_ns[data] = publish_ns
        while self._bytes > MOST_BYTES and len(self._published_ns) > 1:
            oldest = next(iter(self._published_ns))
            del self._published_ns[oldest]
            self._bytes -= len(oldest)

    def standing(self, publishers: int) -> list[tuple[bytes, int]]:
        """Message, and when it was published [ns]; the oldest first. `publishers`: seen on the topic so far."""
        kept = list(self._published_ns.items())
        return kept if publishers > 1 else kept[-1:]

"""When messages come: which topic had a rhythm and has stopped. Times are the caller's [ns]."""

from __future__ import annotations

from collections import deque

REMEMBERED = 20
"""Messages that make a rhythm: a topic with fewer, such as the one shot of an episode, cannot stop."""
MISSED = 10
"""A topic has stopped when so many of its longest recent periods have passed without a message: one or two that are
late or lost are not ten in a row."""
LEAST_NS = 2 * 10**9
"""And not before, however fast it was: a machine may be busy for a second, and a person stops an episode later."""


class Pulse:
    """Of several topics."""

    def __init__(self) -> None:
        self._times: dict[str, deque[int]] = {}
        self.newest_ns = 0
        """When the last message came; a clock that is set back takes it back."""

    def __bool__(self) -> bool:
        """Whether any message has come."""
        return bool(self._times)

    def beat(self, topic: str, now_ns: int) -> None:
        """A message has come. A clock that is set back begins a new rhythm."""
        times = self._times.setdefault(topic, deque(maxlen=REMEMBERED))
        if times and now_ns < times[-1]:
            times.clear()
        times.append(now_ns)
        self.newest_ns = now_ns

    def forget(self, topic: str) -> None:
        """A topic has ended in a way that is known."""
        self._times.pop(topic, None)

    def stopped(self, now_ns: int) -> dict[str, float]:
        """Topics that have stopped, and for how long they have been silent [s]."""
        silent = {topic: now_ns - times[-1] for topic, times in self._times.items() if _stopped(times, now_ns)}
        return {topic: gap_ns * 1e-9 for topic, gap_ns in sorted(silent.items())}


def _stopped(times: deque[int], now_ns: int) -> bool:
    if len(times) < REMEMBERED:
        return False
    longest_ns = max(later - earlier for earlier, later in zip(times, list(times)[1:], strict=False))
    return now_ns - times[-1] > max(LEAST_NS, MISSED * longest_ns)

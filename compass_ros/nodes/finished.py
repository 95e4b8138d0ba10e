"""What a thread works at, awaited in a callback of a node."""

from __future__ import annotations

from collections.abc import Generator
from concurrent.futures import Future
from typing import Generic, TypeVar

Made = TypeVar("Made")


class Finished(Generic[Made]):
    """`await Finished(work)` is what the work makes, or raises what it raises; meanwhile the executor goes on.

    rclpy resumes a callback that waits whenever it wakes: at the next message or timer.
    """

    def __init__(self, work: Future[Made]) -> None:
        self._work = work

    def __await__(self) -> Generator[None, None, Made]:
        while not self._work.done():
            yield
        return self._work.result()

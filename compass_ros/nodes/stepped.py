"""Long work in steps, awaited in a callback of a node."""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import Generic, TypeVar

Made = TypeVar("Made")


class Stepped(Generic[Made]):
    """`await Stepped(steps, wake)` is what the steps return; between two of them the executor does what has come up.

    In a thread the work would take turns with the node for Python's lock, and on a busy machine would starve it.
    """

    def __init__(self, steps: Generator[None, None, Made], wake: Callable[[], None]) -> None:
        """`wake`: of the executor, which otherwise waits for a message or a timer before the next step."""
        self._steps = steps
        self._wake = wake

    def __await__(self) -> Generator[None, None, Made]:
        while True:
            try:
                next(self._steps)
            except StopIteration as end:
                made: Made = end.value
                return made
            self._wake()
            yield

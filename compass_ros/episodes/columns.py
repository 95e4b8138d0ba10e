"""Where the numbers of a source are in messages of one layout: what a reader of one type of message gives."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from compass_ros.episodes.layout import Layout
from compass_ros.episodes.sources import Source
from compass_ros.errors import BagError

Number = tuple[str, int]
"""Path of numbers, and which of them."""


class LacksError(BagError):
    """Messages of a type never hold a quantity."""


@dataclass(frozen=True)
class Columns:
    """A row of a source in a message."""

    numbers: tuple[Number | None, ...]
    """(D,); None: the message lacks it."""
    header: str = ""
    """Path of the header; empty: the message has none."""
    frame: str = ""
    """Frame of what was measured; empty where none is named."""
    publisher: str = ""
    """What in the message tells who published it."""
    covariance: str = ""
    """Path of a 6 x 6 covariance of the position; empty: none."""
    unknown: str = ""
    """Path of a covariance that begins with -1 where nothing was measured; empty: none."""
    since: str = ""
    """Path of a duration after the stamp: the row is of that moment; empty: of the stamp itself."""


@dataclass(frozen=True)
class MessageKind:
    """How the messages of one type are read."""

    columns: Callable[[Layout, Source], Iterator[Columns]]
    """Rows of a source in a message of a layout. Raises LacksError, or BagError where it cannot be understood."""
    entries: Callable[[Layout], Sequence[str]] = lambda layout: ()
    """What such a message calls the things that it holds: joints, frames."""

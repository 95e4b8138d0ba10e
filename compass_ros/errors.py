"""The few errors of the suite. Each message is one line: what, where, what was expected."""

from __future__ import annotations

import difflib
import reprlib
from collections.abc import Iterable


class CompassError(Exception):
    """Root of all errors that a user can cause and mend."""


class ConfigError(CompassError):
    """A configuration (YAML, command line, ROS parameters) is wrong."""


class BagError(CompassError):
    """A bag cannot be used: missing, empty, truncated, foreign, of another cell, or with bad poses or stamps."""


class DataError(CompassError):
    """The recordings are readable but cannot answer the question: no episodes, too slow, too alike."""


class TrackingError(CompassError):
    """Camera images cannot be turned into poses: no fiducials in view, no camera model, wrong encoding."""


class _Narrow(reprlib.Repr):
    """The standard library's, so narrow that it fits a line; its own default may print half a megabyte."""

    def __init__(self) -> None:
        super().__init__()
        self.maxlevel = 2
        self.maxtuple = self.maxlist = self.maxdict = self.maxset = self.maxfrozenset = 3
        self.maxstring = self.maxother = 60

    def repr_int(self, x: int, level: int) -> str:
        """Python refuses to write out numbers of more than 4300 digits."""
        return repr(x) if x.bit_length() < 130 else f"a number of {x.bit_length()} bits"


_narrow = _Narrow()


def shown(value: object) -> str:
    """A value as a message shows it: one line of at most 200 letters, however large it is."""
    text = _narrow.repr(value)
    return text if len(text) <= 200 else f"{text[:197]}..."


def nearest(name: str, known: Iterable[str]) -> str:
    """A hint `; did you mean 'x'?` with the known name nearest to `name`, or an empty string."""
    match = difflib.get_close_matches(name, list(known), n=1, cutoff=0.5)
    return f"; did you mean '{match[0]}'?" if match else ""

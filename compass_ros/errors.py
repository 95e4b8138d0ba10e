"""The few errors of the suite. Each message is one line: what, where, what was expected."""

from __future__ import annotations

import difflib
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


def nearest(name: str, known: Iterable[str]) -> str:
    """A hint `; did you mean 'x'?` with the known name nearest to `name`, or an empty string."""
    match = difflib.get_close_matches(name, list(known), n=1, cutoff=0.5)
    return f"; did you mean '{match[0]}'?" if match else ""

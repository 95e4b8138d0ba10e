"""What anybody on the network may ask for, checked before it reaches a disk, a process or a log."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from compass_ros_interfaces.action import Calibrate
from compass_ros_interfaces.srv import StartEpisode

from compass_ros.errors import BagError, ConfigError

MOST_TEXT = 200
"""Letters of a name, or of a hash."""
MOST_ACTION = 100
MOST_BAGS = 10_000
MOST_PATHS = 1_000_000
"""Letters of all paths together: what a command line takes."""


def one_line(text: str, most: int = 500) -> str:
    """A message for people: no line breaks, no control characters, not endless; what is too long loses its middle."""
    plain = " ".join("".join(c if c.isprintable() else " " for c in text).split())
    kept = (most - 5) // 2
    return plain if len(plain) <= most else f"{plain[:kept]} ... {plain[-kept:]}"


def checked_action(request: StartEpisode.Request) -> dict[str, float]:
    """The shot that comes with the start of an episode. Raises BagError in one line."""
    names, values = list(request.action_names), list(request.action_values)
    if len(names) != len(values) or len(set(names)) != len(names) or len(names) > MOST_ACTION:
        raise BagError(
            f"action: expected as many values as distinct names, at most {MOST_ACTION}; "
            f"found {len(names)} names ({len(set(names))} distinct) and {len(values)} values"
        )
    for name, value in zip(names, values, strict=True):
        checked_text(name, "action")
        if not math.isfinite(value):
            raise BagError(f"action: {name}: expected a finite number, found {value}")
    return dict(zip(names, values, strict=True))


def checked_text(text: str, what: str) -> str:
    """A name or a hash as it is. Raises BagError in one line."""
    if len(text) > MOST_TEXT or not text.isprintable():
        raise BagError(f"{what}: expected up to {MOST_TEXT} printable letters, found {one_line(text, 60)!r}")
    return text


def wrong_text(value: str) -> str:
    """What is wrong with a parameter that is a name or a path, or nothing."""
    return "" if value.isprintable() else f"expected printable letters, found {one_line(value, 60)!r}"


def checked_paths(goal: Calibrate.Goal) -> None:
    """Paths that a command line takes. Raises ConfigError in one line."""
    paths: Sequence[str] = [*goal.bags, goal.cell, goal.output]
    if len(goal.bags) > MOST_BAGS or sum(map(len, paths)) > MOST_PATHS:
        letters = sum(map(len, paths))
        raise ConfigError(
            f"bags: expected at most {MOST_BAGS} paths of {MOST_PATHS} letters together, found {len(goal.bags)} of "
            f"{letters}; name the folder that holds them"
        )
    for path in paths:
        if not path.isprintable():
            raise ConfigError(f"expected a path of printable letters, found {one_line(path, 60)!r}")


def checked_output(wanted: str, own: Path) -> Path:
    """Where a result may go: into the folder that holds the node's `own` output, an absolute path.

    Raises ConfigError in one line.
    """
    home = own.parent.resolve()
    output = Path(wanted).expanduser().absolute() if wanted else own
    if wanted and not output.resolve().is_relative_to(home):
        raise ConfigError(f"output: expected a folder in {home}, where the parameter `output` lies; found {wanted}")
    return output

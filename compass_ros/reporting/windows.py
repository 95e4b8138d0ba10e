"""What one episode of a result is: a shot, a recording, or a window of a long recording."""

from __future__ import annotations

import re
from collections.abc import Sequence

from compass_ros.reporting.extras import Scene
from compass_ros.types import Result

NAME = re.compile(r"(?P<recording>.+) at (?P<start>\d+\.\d) s", re.DOTALL)
"""What `simulation.windows` calls a window: `ramp at 5.0 s`."""


def in_windows(result: Result) -> bool:
    """Whether long recordings were cut into windows."""
    names = (*result.fit, *result.held_out)
    return bool(names) and all(NAME.fullmatch(name) for name in names)


def word(result: Result) -> str:
    """What a reader calls one of its episodes: `window`, or `episode`."""
    return "window" if in_windows(result) else "episode"


def counted(count: int, what: str) -> str:
    """`1 window`, `2 windows`."""
    return f"{count} {what}{'' if count == 1 else 's'}"


def began(result: Result, scene: Scene | None) -> str:
    """What time 0 is of. Only on a table is it a command: a shot."""
    if in_windows(result):
        return "the window began"
    on_table = scene is not None and any(shape.role == "table" for shape in scene.shapes)
    return "the command" if on_table else "the episode began"


def by_recording(names: Sequence[str]) -> list[tuple[str, str]]:
    """Windows as (recording, `at 0.0, 5.0 s`), in the order of the names; each other episode with an empty text."""
    starts: dict[str, list[str]] = {}
    for name in names:
        found = NAME.fullmatch(name)
        own = starts.setdefault(found["recording"] if found else name, [])
        own.extend([found["start"]] if found else [])
    return [
        (recording, f"at {', '.join(sorted(own, key=float))} s" if own else "") for recording, own in starts.items()
    ]

"""The YAML of a first cell, with a comment beside everything that was found, guessed or left out."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable, Sequence

from compass_ros.starter.priors import Guess

_PLAIN = re.compile(r"[A-Za-z_/][A-Za-z0-9_/.@^-]*( [A-Za-z0-9_/.@^;-]+)*")
_WORDS = {"true", "false", "yes", "no", "on", "off", "null", "y", "n"}
_WIDTH = 118


def plain(text: str) -> str:
    """A scalar of YAML: as it is, or in quotes where it could be read as something else."""
    safe = _PLAIN.fullmatch(text) and text.lower() not in _WORDS
    return text if safe else "'" + text.replace("'", "''") + "'"


def listed(names: Iterable[str]) -> str:
    return "[" + ", ".join(plain(name) for name in names) + "]"


def comment(text: str, indent: int = 0) -> list[str]:
    """Lines of a comment."""
    prefix = " " * indent + "# "
    return textwrap.wrap(" ".join(text.split()), _WIDTH, initial_indent=prefix, subsequent_indent=prefix)


def entry(pairs: Sequence[tuple[str, str]]) -> str:
    """One element of a list, on as many lines as it takes."""
    lines = ["  - {"]
    for i, (key, value) in enumerate(pairs):
        said = f"{key}: {value}" + ("}" if i == len(pairs) - 1 else ", ")
        if len(lines[-1]) + len(said) > _WIDTH and lines[-1].strip():
            lines.append("     ")
        lines[-1] += said
    return "\n".join(line.rstrip() for line in lines)


def number(value: float) -> str:
    """Six digits."""
    return f"{value:.6g}"


def parameter(guess: Guess) -> str:
    """One parameter; its default as the scene has it, what is guessed with three digits."""
    default = float(number(guess.default))
    low, high = min(float(f"{guess.low:.3g}"), default), max(float(f"{guess.high:.3g}"), default)
    pairs = [
        ("name", plain(guess.name)),
        ("field", plain(guess.field)),
        ("of", plain(guess.of)),
        ("unit", plain(guess.unit)),
        ("default", number(guess.default)),
        ("bounds", f"[{number(low)}, {number(high)}]"),
        ("half_width", f"{guess.half_width:.3g}"),
    ]
    return entry(pairs + ([("description", plain(guess.why))] if guess.why else []))

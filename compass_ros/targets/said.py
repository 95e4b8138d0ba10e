"""What became of each law on its way into another format."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Fate = Literal["exact", "alike", "left out"]
"""exact: the same motion to rounding; alike: the same physics by another formula; left out: no word for it."""


@dataclass(frozen=True)
class Said:
    """One law or parameter."""

    name: str
    on: tuple[str, ...]
    fate: Fate
    why: str = ""
    """How it differs, or why it is left out."""

    def line(self) -> str:
        where = f" on {', '.join(self.on)}" if self.on else ""
        return f"{self.name}{where}: {self.fate}{f' ({self.why})' if self.why else ''}"

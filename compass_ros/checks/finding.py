"""What a check found: in which recordings, in which samples, and what it looks like."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from compass_ros.types import Ints

Severity = Literal["note", "repaired", "bad"]
"""note: worth knowing; repaired: wrong and surely mended; bad: wrong, and nothing may be concluded from it."""

SHOWN = 3


@dataclass(frozen=True)
class Finding:
    """One thing that is wrong with one signal."""

    kind: str
    severity: Severity
    signal: str
    samples: Mapping[str, tuple[int, ...]]
    """By recording: indices of the samples, from 0; empty where it is all of them."""
    looks: str
    """What it looks like, without the signal, the recordings and a full stop."""

    @property
    def sentence(self) -> str:
        """`swing: ...; in 2 of the bags, s01 (samples 5, 9), s02 (samples 6, ...)`, without a full stop."""
        return f"{self.signal}: {self.looks}; in {self.where}"

    @property
    def where(self) -> str:
        """The recordings, and the first samples in each."""
        named = [f"{name}{_samples(which)}" for name, which in list(self.samples.items())[:SHOWN]]
        more = len(self.samples) - len(named)
        return ", ".join(named) + (f" and {more} more" if more > 0 else "")


def _samples(which: Sequence[int]) -> str:
    if not which:
        return ""
    numbers = ", ".join(str(index) for index in which[:SHOWN])
    return f" (sample{'s' * (len(which) > 1)} {numbers}{', ...' * (len(which) > SHOWN)})"


def told(indices: Ints) -> tuple[int, ...]:
    """Indices as a finding holds them."""
    return tuple(int(index) for index in indices)

"""A sequential test whether the gap between simulator and recordings has grown, with a stated rate of false alarms.

Each episode is one number, its gap. As long as nothing changes, the gaps are exchangeable, and then the rank of each
new one among all before it is uniform and independent of the earlier ranks, whatever their distribution (Renyi 1962).
A bet that pays more the higher the new gap ranks, and 1 on average, multiplies a stake. The stake is split over the
moments at which a change may begin (the shares fall slowly and sum to 1) and over how bold the bet is. Nobody can win
in a fair game: the probability that the stake ever reaches 1 / a is at most a (Ville 1939), in any number of episodes.
So `false_alarm` = 0.01 means: of a hundred tables that never change, at most one on average ever raises an alarm.

The price is patience. Gaps before the test began (held-out episodes of the calibration) join the ranking, not the bets.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from compass_ros.errors import DataError
from compass_ros.types import Floats

_BOLDNESS = (0.1, 0.3, 0.5, 0.7)
"""Exponents e of the bets r^(e - 1) on rank r: near 0 for a gap that grows much, near 1 for a slight growth."""

_PATIENCE = 5.0
"""Episodes after which half of the stake is in play: more finds late changes sooner and early ones later."""


@dataclass(frozen=True)
class GapTest:
    """Where the test stands."""

    gaps: tuple[float, ...] = ()
    """All gaps so far [m], the reference first."""
    references: int = 0
    """How many of them were there before the test began."""
    stakes: tuple[float, ...] = (0.0,) * len(_BOLDNESS)
    """What is in play now, for each boldness."""
    highest: float = 1.0
    """The most that the whole stake has ever been."""

    @property
    def tested(self) -> int:
        """Episodes since the test began."""
        return len(self.gaps) - self.references

    @property
    def e_value(self) -> float:
        """The whole stake now, 1 at the beginning: evidence that the gap has grown."""
        return float(np.mean(self.stakes)) + _kept(self.tested)

    def alarm(self, false_alarm: float) -> bool:
        """Whether the gap has grown, at this probability of ever saying so on an unchanged table."""
        return self.highest >= 1 / false_alarm


def begin(reference: Iterable[float] = ()) -> GapTest:
    """A test that knows the gaps of some episodes already. Raises DataError for one that is no distance."""
    known = tuple(map(_checked, reference))
    return GapTest(known, len(known))


def observe(test: GapTest, gap: float) -> GapTest:
    """One more episode. Raises DataError for a gap [m] that is no distance."""
    gaps = (*test.gaps, _checked(gap))
    test = replace(test, gaps=gaps)
    rank = int(np.sum(np.array(gaps) >= gap))  # 1: the largest so far; equals count against a growth
    share = _kept(test.tested - 1) - _kept(test.tested)
    stakes = tuple(
        (stake + share) * float(_payoffs(len(gaps), boldness)[rank - 1])
        for stake, boldness in zip(test.stakes, _BOLDNESS, strict=True)
    )
    test = replace(test, stakes=stakes)
    return replace(test, highest=max(test.highest, test.e_value))


def _kept(episodes: int) -> float:
    """Share of the stake that is not in play after so many episodes."""
    return _PATIENCE / (_PATIENCE + episodes)


@lru_cache(maxsize=4096)
def _payoffs(count: int, boldness: float) -> Floats:
    """(count,) what the bet pays for each rank; 1 on average."""
    raw = np.arange(1, count + 1, dtype=float) ** (boldness - 1)
    return np.asarray(raw / raw.mean())


def _checked(gap: float) -> float:
    if not (math.isfinite(gap) and gap >= 0):
        raise DataError(f"gap of an episode: expected a distance [m], found {gap}")
    return float(gap)

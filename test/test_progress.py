"""Progress as it is shown: begins at 0, never falls, ends at 1; five ways in which what is reported does."""

from __future__ import annotations

import math

import numpy as np
import pytest

from compass_ros.progress import Steady
from compass_ros.types import Progress


def shown(reported: list[float]) -> list[float]:
    """Shares done as a person sees them, with the end."""
    seen: list[float] = []

    def see(progress: Progress) -> bool:
        seen.append(progress.done)
        return progress.stage != "stop"

    steady = Steady(see)
    for done in reported:
        assert steady(Progress("s", 0, done, math.nan, math.nan))
    assert not steady(Progress("stop", 0, reported[-1], math.nan, math.nan)), "the answer is handed on"
    steady.end("written")
    return seen


@pytest.mark.parametrize(
    "reported",
    [
        [0.0, 0.3, 0.3, 0.8, 1.0],
        [0.0, 0.5, 0.95, 0.0, 0.5, 1.0],  # begins anew
        [0.2, 0.1, 0.2, 0.1, 0.2],  # jitters
        [0.0, 1.0, 0.0, 1.0, 0.0, 1.0],  # begins anew at its end
        [0.0, 1.7, -0.4, 0.5],  # outside of its range
        list(np.random.default_rng(0).uniform(size=200)),
    ],
)
def test_whatever_is_reported(reported: list[float]) -> None:
    seen = shown(reported)
    assert np.all(np.diff(seen) >= 0)
    assert seen[0] >= 0
    assert seen[-1] == 1.0
    assert seen[-2] <= 1.0


def test_what_begins_anew_still_moves() -> None:
    seen = shown([0.0, 0.6, 0.0, 0.5, 0.9])
    assert seen[:5] == pytest.approx([0.0, 0.6, 0.6, 0.8, 0.96])


def test_shares_follow_each_other() -> None:
    seen: list[float] = []

    def see(progress: Progress) -> bool:
        seen.append(progress.done)
        return True

    steady = Steady(see)
    for low, high in ((0.0, 0.7), (0.7, 1.0)):
        part = steady.share(low, high)
        for done in (0.0, 0.5, 1.0):
            part(Progress("s", 0, done, math.nan, math.nan))
    assert seen == pytest.approx([0.0, 0.35, 0.7, 0.7, 0.85, 1.0])

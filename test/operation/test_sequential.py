"""The running test of the gap: its rate of false alarms by simulation, its power, its axioms."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from compass_ros.errors import DataError
from compass_ros.operation.sequential import GapTest, begin, observe
from compass_ros.types import Floats


def run(gaps: Floats, references: int) -> GapTest:
    test = begin(gaps[:references])
    for gap in gaps[references:]:
        test = observe(test, float(gap))
    return test


@pytest.mark.parametrize("references", [0, 4])
def test_an_unchanged_table_raises_an_alarm_no_more_often_than_stated(references: int) -> None:
    """At a stated 10 %, over the whole of 50 episodes; 400 tables make a standard error of 1.5 %."""
    rng = np.random.default_rng(references)
    tables = rng.standard_cauchy((400, references + 50)) ** 2  # no variance, no mean: ranks do not care
    alarms = np.mean([run(gaps, references).alarm(0.1) for gaps in tables])
    assert alarms <= 0.1 + 2 * 0.015


def test_the_stake_is_one_on_average_over_all_orders() -> None:
    """Exactly: the mean over all 720 orders of six gaps is 1 after every episode, so the game is fair."""
    orders = list(itertools.permutations(range(6)))
    for episodes in range(1, 7):
        stakes = [run(np.array(order[:episodes], float), 0).e_value for order in orders]
        assert np.mean(stakes) == pytest.approx(1, abs=1e-12)


def delay(rng: np.random.Generator, before: int, factor: float) -> int:
    """Episodes from a change to the alarm at 1 %, after four reference episodes and some without a change."""
    test = run(rng.lognormal(0, 0.3, 4 + before), 4)
    for episode in range(1, 101):
        test = observe(test, float(factor * rng.lognormal(0, 0.3)))
        if test.alarm(0.01):
            return episode
    return 1000


def test_a_gap_that_doubles_is_noticed() -> None:
    rng = np.random.default_rng(3)
    delays = [delay(rng, before=20, factor=2.0) for _ in range(40)]
    assert np.median(delays) <= 12
    assert np.quantile(delays, 0.9) <= 25


def test_a_gap_that_shrinks_is_no_alarm() -> None:
    rng = np.random.default_rng(4)
    assert not run(np.concatenate([rng.lognormal(0, 0.3, 20), rng.lognormal(-2, 0.3, 40)]), 4).alarm(0.01)


def test_identical_episodes_are_no_alarm() -> None:
    assert run(np.full(50, 0.01), 4).highest <= 1


def test_an_alarm_stays() -> None:
    test = run(np.concatenate([np.linspace(1, 2, 30), np.full(10, 0.5)]), 4)
    assert test.alarm(0.01)
    assert test.e_value < test.highest


@pytest.mark.parametrize("gap", [float("nan"), float("inf"), -0.1])
def test_what_is_no_distance_is_refused(gap: float) -> None:
    with pytest.raises(DataError, match=r"expected a distance \[m\]"):
        observe(begin(), gap)
    with pytest.raises(DataError, match=r"expected a distance \[m\]"):
        begin([gap])

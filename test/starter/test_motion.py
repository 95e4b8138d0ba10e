"""Who follows whom, and by how much later, with the delay planted."""

from __future__ import annotations

import numpy as np
import pytest

from compass_ros.starter.motion import Column, lag
from compass_ros.types import Floats


def swing(time: Floats) -> Floats:
    return np.asarray(np.sin(2.1 * time) + 0.4 * np.sin(5.3 * time + 1) + 0.2 * time)


def column(rate_hz: float, late_s: float = 0.0, noise: float = 0.0, since_s: float = 0.0) -> Column:
    time = np.arange(since_s, 20, 1 / rate_hz)
    value = swing(time - late_s) + np.random.default_rng(1).normal(0, noise, time.shape)
    return Column(10**18 + np.round(time * 1e9).astype(np.int64), value)


@pytest.mark.parametrize("late_s", [0.0, 0.013, 0.08, 0.25, 0.7, -0.1])
@pytest.mark.parametrize("rates_hz", [(100, 100), (50, 1000), (500, 30)])
def test_the_planted_delay_is_found(late_s: float, rates_hz: tuple[float, float]) -> None:
    found = lag(column(rates_hz[0]), column(rates_hz[1], late_s, 0.002, 0.4), held=False)
    assert found.seconds == pytest.approx(late_s, abs=0.003)
    assert found.correlation > 0.99


def test_a_held_command_is_late_by_nothing_more() -> None:
    """Commands at 10 Hz hold for 100 ms; who follows each at once follows what is held, not the line between."""
    command = column(10)
    fine = np.arange(0, 19, 0.005)
    stamp = 10**18 + np.round(fine * 1e9).astype(np.int64)
    answer = Column(stamp + 40_000_000, command.at(stamp, True))
    assert lag(command, answer).seconds == pytest.approx(0.04, abs=0.006)


@pytest.mark.parametrize("still", ["command", "answer", "both"])
def test_what_does_not_move_follows_nothing(still: str) -> None:
    moving = column(100)
    resting = Column(moving.stamp_ns, np.full(len(moving.stamp_ns), 0.3))
    pair = (resting if still != "answer" else moving, resting if still != "command" else moving)
    assert lag(*pair).correlation == 0.0


def test_other_motions_do_not_correlate() -> None:
    rng = np.random.default_rng(2)
    white = [rng.normal(size=4000) for _ in range(2)]
    stamp = 10**18 + np.arange(4000) * 10**7
    assert abs(lag(Column(stamp, white[0]), Column(stamp, white[1])).correlation) < 0.2

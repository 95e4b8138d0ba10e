"""Counting what never came."""

from __future__ import annotations

import numpy as np

from compass_ros.nodes.tracker_health import Counts, StampGaps, health_message

PERIOD = 11_111_111


def missing(stamps: list[int]) -> int:
    gaps = StampGaps()
    return sum(gaps.take(stamp) for stamp in stamps)


def test_gaps_in_the_stamps_are_counted() -> None:
    stamps = [number * PERIOD for number in range(200) if number not in (50, 51, 120)]
    assert missing(stamps) == 3


def test_jitter_is_no_gap() -> None:
    rng = np.random.default_rng(0)
    stamps = np.arange(500) * PERIOD + rng.uniform(-0.15, 0.15, 500) * PERIOD
    assert missing(stamps.astype(int).tolist()) == 0


def test_a_clock_that_steps_back_or_stands_is_no_gap() -> None:
    assert missing([*(n * PERIOD for n in range(50)), 5, 5, *(n * PERIOD for n in range(1, 50))]) == 0


def test_nothing_seen_is_said_as_such() -> None:
    values = {v.key: v.value for v in health_message("t", Counts(), 1.0, float("nan"), ["puck1"], []).values}
    assert values["rate [1/s]"] == "0.0"
    assert values["latency p99 [ms]"] == "nan"
    assert values["share of images with puck1"] == "0.000"

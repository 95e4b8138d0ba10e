"""The table over a fan: without chance and the same everywhere it is the table; its chance is what it says."""

from __future__ import annotations

import numpy as np
import pytest

from compass_ros.worlds.table import cell, discs, fan
from test.worlds.task import task_of

CELL, TASK = task_of("air_hockey")
VALUES = {p.name: p.default for p in TASK.parameters} | dict(cell.TRUE)
LOW, HIGH = (np.array([getattr(a, end) for a in CELL.action]) for end in ("low", "high"))


def commands(count: int) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    return np.random.default_rng(0).uniform(LOW, HIGH, (count, 4))


def test_an_even_fan_is_the_table_of_the_other_program() -> None:
    rng = np.random.default_rng(0)
    fast = fan.play(VALUES, commands(2), 1.0, fan.even(0.8), rng)
    slow = discs.play(discs.Rig(VALUES), commands(2), 1.0)[:, :, :4]
    assert np.abs(fast - np.swapaxes(slow, 0, 1)).max() < 1e-10


def test_pucks_slide_farther_where_more_is_carried() -> None:
    weak, strong = (fan.play(VALUES, commands(4), 1.0, fan.even(lift), np.random.default_rng(0)) for lift in (0.7, 0.9))
    way = [np.linalg.norm(np.diff(path[:, :, :2], axis=1), axis=2).sum(axis=1) for path in (weak, strong)]
    assert (way[1] > way[0]).all()


def test_gusts_have_their_size_and_their_memory() -> None:
    blown = fan.Fan(0.8, 0.8, shot=0.0, gust=0.02, memory_s=0.1)
    wander = blown.wander(400, 1000, np.random.default_rng(1))
    assert wander.std() == pytest.approx(0.02, rel=0.05)
    assert np.mean(wander[:, 0] * wander[:, 100]) / 0.02**2 == pytest.approx(np.exp(-1), abs=0.15)


def test_the_same_seed_gives_the_same_shots_and_the_tracker_its_noise() -> None:
    one, again, other = (cell.shoot(TASK, cell.Condition("low"), commands(3), seed, steps=10) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one.seen, again.seen)
    assert np.abs(one.seen - other.seen).max() > 1e-4
    still = one.episodes[0].tracks[1]
    before = still.value[still.stamp_ns < one.episodes[0].start_ns]
    assert before.mean(axis=0) == pytest.approx([-0.075 + 0.03, -0.075 - 0.02], abs=2e-3)
    assert before.std() > 1e-4
    assert one.episodes[0].action == again.episodes[0].action


def test_heavier_pucks_are_carried_less() -> None:
    light, heavy = (cell.shoot(TASK, cell.Condition("low", mass=m), commands(3), 1, steps=40) for m in (1.0, 1.3))
    way = [np.linalg.norm(np.diff(p.seen[:, :, 2:], axis=1), axis=2).sum(axis=1) for p in (light, heavy)]
    assert (way[0] > way[1]).all()

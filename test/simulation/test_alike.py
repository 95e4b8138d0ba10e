"""Rollouts that repeat the beginning of others: the same to the bit, for less."""

from __future__ import annotations

import numpy as np
import pytest

from compass_ros.cells import load
from compass_ros.simulation import Simulator
from compass_ros.types import Floats, Ints

SHOTS = 3
TIME = np.arange(-0.25, 2.5, 1 / 60)
LATE, EARLY, SEEN = "right_wall@dyna@damping", "puck1@dyna@mass", "env@camera@bias_x"


@pytest.fixture(scope="module")
def simulator() -> Simulator:
    return Simulator(load("air_hockey"), threads=1)


def rows(simulator: Simulator) -> tuple[Floats, Floats, Floats, Ints]:
    """Three shots at the defaults, and again with each of three parameters changed."""
    rng = np.random.default_rng(3)
    cell = simulator.cell
    shots = np.array([[rng.uniform(a.low, a.high) for a in cell.action] for _ in range(SHOTS)])
    values = np.tile(cell.defaults, (4, SHOTS, 1))
    for row, name in enumerate((LATE, EARLY, SEEN), 1):
        values[row, :, cell.index(name)] += 0.3 * cell.parameters[cell.index(name)].half_width
    count = 4 * SHOTS
    like = np.tile(np.arange(SHOTS), 4)
    return values.reshape(count, -1), np.tile(shots, (4, 1)), np.tile(TIME, (count, 1)), like


def test_the_same_bits_for_fewer_simulated_seconds(simulator: Simulator) -> None:
    values, inputs, times, like = rows(simulator)
    expected = simulator.observe(values, inputs, times)
    first, same = simulator.observe_alike(values, inputs, times, like, np.zeros(len(values)))
    spent = simulator.simulated_seconds
    again, once_more = simulator.observe_alike(values, inputs, times, like, same)
    assert (first == expected).all()
    assert (again == expected).all()
    assert simulator.simulated_seconds - spent < 0.8 * len(values) * TIME[-1]
    np.testing.assert_array_equal(same, once_more)


def test_it_says_when_a_parameter_begins_to_act(simulator: Simulator) -> None:
    values, inputs, times, like = rows(simulator)
    observed, same = simulator.observe_alike(values, inputs, times, like, np.zeros(len(values)))
    late, early, seen = same.reshape(4, SHOTS)[1:]
    for shot, onset in enumerate(late):
        moved = (observed[SHOTS + shot] != observed[shot]).any(axis=1)
        first = TIME[moved.argmax()] if moved.any() else np.inf
        assert onset <= first < onset + 0.05 or (not moved.any() and onset >= TIME[-1])
    assert (early < 0.5 * TIME[-1]).all()
    assert (seen >= TIME[-1]).all()  # the camera is no part of the motion
    assert (observed[3 * SHOTS :] != observed[:SHOTS]).any(axis=(1, 2)).all()


def test_what_is_said_too_late_is_noticed(simulator: Simulator) -> None:
    values, inputs, times, like = rows(simulator)
    wrong = np.where(np.arange(len(values)) < SHOTS, 0.0, 1.0)  # mass and controls act long before
    observed, _ = simulator.observe_alike(values, inputs, times, like, wrong)
    expected = simulator.observe(values, inputs, times)
    assert (observed[2 * SHOTS : 3 * SHOTS] == expected[2 * SHOTS : 3 * SHOTS]).all()


def test_other_shots_are_not_taken_for_the_same(simulator: Simulator) -> None:
    values, inputs, times, like = rows(simulator)
    inputs = inputs.copy()
    inputs[SHOTS:, 3] *= 1.1
    observed, _ = simulator.observe_alike(values, inputs, times, like, np.full(len(values), 2.0))
    assert (observed == simulator.observe(values, inputs, times)).all()

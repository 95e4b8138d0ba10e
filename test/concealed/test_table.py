"""The table without laws is the plain simulator; what is added to contacts obeys mechanics."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from compass_ros.concealed.law import Ingredient
from compass_ros.concealed.laws import LAWS
from compass_ros.concealed.table import Played
from compass_ros.simulation import Simulator
from compass_ros.types import Floats
from test.concealed.scene import INPUTS, TIMES, cell, distance, ingredient, table, tracks

NUMERICS_M = 2e-3
"""What halving the time step moves these shots by, rms, before any parameter is fitted to it."""


@pytest.fixture(scope="module")
def base() -> Played:
    return table().play()


@pytest.fixture(scope="module")
def plain() -> Floats:
    own = cell()
    return Simulator(own, threads=1).observe(np.tile(own.defaults, (len(INPUTS), 1)), INPUTS, TIMES)


def test_without_laws_it_is_the_plain_simulator(base: Played, plain: Floats) -> None:
    assert np.abs(tracks(base) - plain).max() < 1e-6


def test_a_finer_clock_stays_near(base: Played, plain: Floats) -> None:
    steps = {dt: distance(tracks(table(dt).play()), plain) for dt in (0.0005, 0.00025)}
    assert 0 < steps[0.0005] < steps[0.00025] < NUMERICS_M


def test_the_same_play_gives_the_same_bits(base: Played) -> None:
    again = table().play()
    np.testing.assert_array_equal(again.position, base.position)
    assert again.impacts == base.impacts


def test_impacts_name_who_meets_whom(base: Played) -> None:
    touched = base.touched()
    assert touched["pusher"] == len(INPUTS)
    assert touched["puck2"] >= 1
    times = [impact.time for impact in base.impacts]
    assert times == sorted(times)
    assert all(impact.approach > 0 for impact in base.impacts)


def test_pucks_slow_down_by_their_friction_between_contacts(base: Played) -> None:
    """mu g (1 - lift) is 0.05 * 9.81 * 0.2 m/s^2."""
    flights: list[tuple[float, float, float, int]] = []
    for shot in range(len(INPUTS)):
        hits = [i.time for i in base.impacts if i.shot == shot and "puck1" in i.names]
        flights.extend((end - start, start, end, shot) for start, end in pairwise(hits))
    _, start, end, shot = max(flights)
    first, second = start + 0.1, end - 0.01
    rows = [round(t / base.time_step) for t in (first, second)]
    speeds = np.linalg.norm(base.velocity[rows, shot, 0], axis=1)
    assert speeds[0] - speeds[1] == pytest.approx(0.05 * 9.81 * 0.2 * (second - first), rel=1e-3)


def test_rims_that_rub_slow_the_slide_along_a_wall_and_turn_it_at_most_to_rolling(base: Played) -> None:
    """Impulse along the wall is at most mu times the normal one, and never makes a puck slide backwards."""
    wall = next(i for i in base.impacts if "left_wall" in i.names or "right_wall" in i.names)
    puck = 0 if "puck1" in wall.names else 1
    rows = [round((wall.time + dt) / base.time_step) for dt in (-0.002, 0.06)]
    slides = []
    for friction in (0.0, 0.02, 0.05):
        rim = Ingredient(LAWS["tangential_impulse"], size=100 * friction)
        before, after = table().play([rim] if friction else []).velocity[rows, wall.shot, puck]
        normal = abs(after[1] - before[1])
        lost = (abs(before[0]) - abs(after[0])) - (rows[1] - rows[0]) * base.time_step * 0.05 * 9.81 * 0.2
        assert -0.01 < lost <= friction * normal * 1.1 + 0.01
        assert after[0] * before[0] > 0
        slides.append(abs(after[0]))
    assert slides[0] > slides[1] > slides[2]


def test_restitution_falls_with_the_speed_of_impact(base: Played) -> None:
    """The damping of each contact is decided at its beginning and forgotten at its end."""
    wall = next(i for i in base.impacts if "wall" in "".join(i.names))
    puck, axis = (0 if "puck1" in wall.names else 1), (0 if {"front_wall", "back_wall"} & set(wall.names) else 1)
    rows = [round((wall.time + dt) / base.time_step) for dt in (-0.002, 0.06)]
    ratios = []
    for size in (0.0, 1.0, 4.0):
        law = Ingredient(LAWS["rate_dependent_restitution"], shape={"power": 1.0}, size=size)
        before, after = table().play([law]).velocity[rows, wall.shot, puck, axis]
        ratios.append(-after / before)
    assert ratios[0] > ratios[1] > ratios[2] > 0


def test_a_law_on_one_puck_leaves_the_other_alone_until_they_meet(base: Played) -> None:
    drag = ingredient("viscous_drag", base, size=20.0)
    alone = Ingredient(drag.law, ("puck2",), drag.shape, drag.size)
    moved = table().play([alone])
    meets = [i.time for i in base.impacts if {"puck1", "puck2"} == set(i.names) and i.shot == 0]
    end = round((meets[0] if meets else 2.5) / base.time_step)
    np.testing.assert_array_equal(moved.position[:end, 0, 0], base.position[:end, 0, 0])

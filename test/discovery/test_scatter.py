"""Pushes that differ by chance: deviations planted in each shot come back, with their spread."""

from __future__ import annotations

import numpy as np
import pytest

from compass_ros.calibration.likelihood import Likelihood
from compass_ros.discovery.candidates import scattered
from compass_ros.discovery.choice import Choice, undecided
from compass_ros.discovery.choose import _with_scatter
from compass_ros.discovery.scatter import BY_CHANCE, bent_by, spreads
from compass_ros.discovery.unseen import HeldOut, held_out
from compass_ros.simulation.effects import EFFECTS, Attached
from compass_ros.types import Floats
from test.discovery.planted import CALM, HELD_OUT, PUCKS, asked_of_table, recorded_with, space_of
from test.simulation.table import actions, cell, simulator, values

JITTER, SWIRL = Attached(EFFECTS["stroke_jitter"], ()), Attached(EFFECTS["swirl"], PUCKS)
SHOTS = np.vstack([CALM, CALM * [1.0, 1.0, 0.9, 1.1]])
DEVIATION = np.array([0.02, -0.03, 0.01, -0.01, 0.04, -0.02])


def test_a_rollout_has_the_deviation_that_its_input_says_whatever_the_spread() -> None:
    wider, shots = simulator().with_effects([JITTER]), actions(3)
    times = np.tile(np.linspace(0, 1, 20), (3, 1))
    own = wider.inputs(shots) + np.array([0, 0, 0, 0, 1.0]) * np.array([[0.1], [0.0], [-0.2]])
    for spread in (0.0, 0.05):
        scattering = wider.observe(np.hstack([values(count=3), np.full((3, 1), spread)]), own, times)
        for row, deviation in enumerate((0.1, 0.0, -0.2)):
            alone = wider.observe(np.append(values()[0], deviation)[None], shots[row : row + 1], times[:1])
            np.testing.assert_array_equal(scattering[row], alone[0])
    assert wider.launch_std(np.append(values()[0], 0.05)) == pytest.approx([0, 0, 0, 0, 0.05])


def recorded(shots: Floats, deviation: Floats, seed: int = 0) -> Likelihood:
    return recorded_with([JITTER], deviation[:, None], shots, seed)


def tried(deviation: Floats, others: Likelihood | None = None) -> tuple[Choice, HeldOut]:
    """What is said of shots with these deviations, judged by others; by default by two that scatter too."""
    space = space_of(recorded(SHOTS, deviation))
    unseen = held_out(others or recorded(HELD_OUT, np.array([0.03, -0.02]), 1), space.likelihood, space.fit)
    return _with_scatter(undecided(space), space, (), unseen), unseen


@pytest.mark.slow
def test_deviations_and_their_spread_are_found_and_predict_other_shots() -> None:
    choice, unseen = tried(DEVIATION)
    (joint,) = choice.good(unseen)
    assert joint.name == "stroke_jitter"
    assert unseen.share(joint) > 0.9
    discount = cell().index("pusher@actuation@vel_discount")
    mean = joint.fit.point.values[discount] / cell().defaults[discount]  # that of the deviations is the parameter's
    speed = mean * (1 + joint.fit.point.launch[:, -1])
    assert speed / np.mean(speed) == pytest.approx((1 + DEVIATION) / np.mean(1 + DEVIATION), abs=0.004)
    (at,) = spreads(joint)
    assert joint.fit.point.values[at] == pytest.approx(np.std(DEVIATION, ddof=1), rel=0.25)
    assert 2 * joint.fit.point.cost < 1.1 * joint.likelihood.measurements


@pytest.mark.slow
def test_deviations_that_a_speed_explains_are_no_scatter() -> None:
    choice, _ = tried(-0.3 * (SHOTS[:, 3] - np.mean(SHOTS[:, 3])))
    assert not choice.singles


def test_a_dead_band_and_a_limit_of_the_speed_bend_deviations() -> None:
    told = np.linspace(0.4, 0.7, 9)
    reached = np.minimum(told - 0.02, 0.57) / told
    deviation = reached / np.mean(reached) - 1
    unrelated = np.random.default_rng(0).normal(size=(9, 3))
    assert bent_by(told[:, None], deviation) < bent_by(np.column_stack([told, unrelated]), deviation) < BY_CHANCE
    assert bent_by(told[:2, None], deviation[:2]) == 1


def test_deviations_by_chance_are_rarely_called_bent() -> None:
    draws = np.random.default_rng(1).normal(size=(1000, 9, 5))
    alarms = sum(bent_by(draw[:, 1:], draw[:, 0]) < BY_CHANCE for draw in draws)
    assert 0 < alarms < 18  # 10 are expected at most; more than 17 in one of a hundred runs


def test_a_scatter_is_no_law() -> None:
    assert "stroke_jitter" not in {c.name for c in asked_of_table()}
    assert [
        c.name
        for c in scattered(simulator(), simulator().defaults, actions(3), np.tile(np.linspace(0, 2.5, 50), (3, 1)))
    ] == ["stroke_jitter"]

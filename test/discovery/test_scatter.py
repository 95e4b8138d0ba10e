"""Pushes that differ by chance: deviations planted in each shot come back, with their spread."""

from __future__ import annotations

import numpy as np
import pytest

from compass_ros.discovery.candidates import Candidate
from compass_ros.discovery.hypothesis import Hypothesis
from compass_ros.discovery.scatter import ranked_scatter, with_scatter
from compass_ros.simulation.effects import EFFECTS, Attached
from compass_ros.types import Floats
from test.discovery.planted import CALM, recorded_with, response_of
from test.simulation.table import actions, cell, simulator, values

JITTER = Attached(EFFECTS["stroke_jitter"], ())
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


def plain(deviation: Floats) -> Hypothesis:
    response = response_of(recorded_with([JITTER], deviation[:, None], SHOTS))
    return Hypothesis((), response.simulator, response.likelihood, response.fit)


def test_deviations_and_their_spread_are_found() -> None:
    parent = plain(DEVIATION)
    ranked = ranked_scatter(parent.response, Candidate(JITTER))
    found = with_scatter(parent, ranked)
    discount = cell().index("pusher@actuation@vel_discount")
    mean = found.fit.point.values[discount] / cell().defaults[discount]  # that of the deviations is the parameter's
    speed = mean * (1 + found.fit.point.launch[:, -1])
    assert speed / np.mean(speed) == pytest.approx((1 + DEVIATION) / np.mean(1 + DEVIATION), abs=0.004)
    assert found.fit.point.values[-1] == pytest.approx(np.std(DEVIATION, ddof=1), rel=0.25)
    assert 2 * found.fit.point.cost < 1.1 * found.likelihood.measurements
    assert ranked.gain > 100
    assert found.log_evidence - parent.free.alone > 100
    assert found.std[-1] == pytest.approx(found.fit.point.values[-1] / np.sqrt(12))


def test_no_deviations_cost_evidence() -> None:
    parent = plain(np.zeros(len(SHOTS)))
    ranked = ranked_scatter(parent.response, Candidate(JITTER))
    assert ranked.gain < 0
    assert ranked.seen

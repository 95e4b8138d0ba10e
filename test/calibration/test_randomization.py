"""Algorithm 2: who is randomised, and where."""

from __future__ import annotations

import numpy as np

from compass_ros.calibration.randomization import active_parameters, randomise, randomised_box
from compass_ros.types import Parameter

PARAMETERS = tuple(Parameter(f"a@b@{n}", 0.0, -1.0, 1.0, "1", 0.5) for n in "xyz")


def test_only_parameters_with_an_edge_are_randomised_around_their_value() -> None:
    psi = np.array([[0.9, 0.0], [0.5, 0.5], [0.0, 0.6]])
    active = active_parameters(psi, 0.5)
    assert active.tolist() == [True, False, True]
    box = randomised_box(np.array([0.0, 0.3, 0.8]), active, PARAMETERS)
    drawn = randomise(box, 2000, np.random.default_rng(0))
    assert np.all(drawn[:, 1] == 0.3)
    assert np.allclose([drawn[:, 0].min(), drawn[:, 0].max()], [-0.5, 0.5], atol=0.01)
    assert np.allclose([drawn[:, 2].min(), drawn[:, 2].max()], [0.3, 1.0], atol=0.01)  # cut at the bound
    assert np.allclose(drawn[:, 2].mean(), 0.65, atol=0.02)  # uniform within, nothing piled up at the bound


def test_a_fixed_value_outside_its_bounds_stays() -> None:
    box = randomised_box(np.array([2.0, 0.0, 0.0]), np.array([False, True, True]), PARAMETERS)
    assert box.low[0] == box.high[0] == 2.0

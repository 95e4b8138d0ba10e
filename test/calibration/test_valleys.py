"""Where parameters cancel, a rough simulator's own steps are not information; a real difference between them is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from compass_ros.calibration.cost import start
from compass_ros.calibration.differences import Linear, linearise
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.refine import refine
from compass_ros.calibration.valleys import along_valleys
from compass_ros.types import Floats
from test.calibration.toys import likelihood

SHOTS = np.linspace(0.5, 1.5, 6)[:, None]
ROUGH = 0.02
"""Of the observation [sigma], up and down within a hundredth of a prior width."""
FASTER = np.array([100.0, 137.0])
ACROSS = np.array([1.0, -1.0]) / np.sqrt(2)


def damped(own: float) -> Likelihood:
    """Two dampings that add up, but for a share `own` of the first; the observation is in units of sigma."""

    def predict(values: Floats, inputs: Floats, times: Floats) -> Floats:
        total = values.sum(axis=1) + own * values[:, 0]
        rough = ROUGH * np.sin(values * FASTER).sum(axis=1)[:, None] * np.cos(7 * times)
        return np.asarray((100 * inputs * np.exp(-total[:, None] * times) + rough)[..., None])

    return likelihood(predict, (0.8, 0.2), SHOTS, sigma=1.0, noise=0.0, half_width=1.0, seconds=2.0, frames=60, seed=0)


def test_roughness_between_parameters_that_cancel_is_not_information() -> None:
    """Of two dampings that add up, recordings know the sum; of the difference, what the prior says."""
    found = refine(damped(0.0), np.zeros(2))
    spread = found.covariance[:2, :2]
    assert found.fit.point.values.sum() == pytest.approx(1.0, abs=0.01)
    assert np.sqrt(ACROSS @ spread @ ACROSS) == pytest.approx(1.0, abs=0.1)
    assert abs(found.fit.point.values @ ACROSS) < 0.2, "the prior's mean, but for what the roughness makes of it"


@pytest.mark.parametrize("own", [0.0, 0.02])
def test_what_is_left_where_parameters_cancel_is_measured(own: float) -> None:
    given = damped(own)
    point, both = start(given, np.array([0.8, 0.2])), np.arange(2)
    rough = linearise(given, point, both, np.full(2, 1e-3))
    measured = along_valleys(given, point, rough, both, robust=4.0)
    total, times = 1.0 + 0.8 * own, given.time_s
    slope = -100 * SHOTS * times * np.exp(-total * times) * own / np.sqrt(2)
    error = [np.linalg.norm(across(linear) - slope) for linear in (rough, measured)]
    assert error[0] > 5
    assert error[1] < 0.1 * error[0]


def test_a_step_along_a_valley_ends_at_the_bound_that_it_meets() -> None:
    """One of two dampings that add up lies near its bound: a step that it cannot follow would be a step of the sum."""
    given = damped(0.0)
    second = given.parameters[1]
    near = replace(given, parameters=(given.parameters[0], replace(second, low=0.15)))
    point, both = start(near, np.array([0.8, 0.2])), np.arange(2)
    measured = along_valleys(near, point, linearise(near, point, both, np.full(2, 1e-3)), both, robust=4.0)
    assert np.linalg.norm(across(measured)) < 5.0  # 0 but for the roughness; beyond the bound it would be 50


def across(linear: Linear) -> Floats:
    """(E, F) change of the residual as one damping grows for the other."""
    return np.asarray((linear.jacobian @ ACROSS)[..., 0])


def test_bounds_hold_where_a_direction_would_leave_them() -> None:
    """One side is as good as two."""
    asked: list[Floats] = []
    given = damped(0.02)
    there = np.array([10.0, -9.0])

    def predict(values: Floats, inputs: Floats, times: Floats) -> Floats:
        asked.append(values)
        return given.predict(values, inputs, times)

    linear = linearise(given, start(given, there), np.arange(2), np.full(2, 1e-3))
    along_valleys(replace(given, predict=predict), start(given, there), linear, np.arange(2), robust=4.0)
    assert np.concatenate(asked).max() <= 10.0


def test_a_direction_is_asked_again_only_where_the_first_step_was_too_short() -> None:
    asked: list[Floats] = []
    given = damped(0.02)
    point, both = start(given, np.array([0.8, 0.2])), np.arange(2)

    def predict(values: Floats, inputs: Floats, times: Floats) -> Floats:
        asked.append(values)
        return given.predict(values, inputs, times)

    counted = replace(given, predict=predict)
    rough = linearise(given, point, both, np.full(2, 1e-3))
    once = along_valleys(counted, point, rough, both, robust=4.0)
    assert len(asked) == 2, "roughness had passed for information"
    along_valleys(counted, point, once, both, robust=4.0)
    assert len(asked) == 3

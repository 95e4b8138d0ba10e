"""Refinement: a growing horizon where a whole trajectory misleads, and planted parameters of the table found again."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from compass_ros.calibration.cost import Point, start
from compass_ros.calibration.least_squares import minimise
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.refine import Refined, growing, refine, standard_errors
from compass_ros.calibration.residuals import chi_square
from compass_ros.types import Floats
from test.calibration.toys import likelihood, oscillation
from test.simulation.table import actions, cell, simulator

SHOTS = np.array([[1.0], [0.9], [1.1], [0.8]])
NAMES = (
    "puck1@dyna@friction_sliding",
    "puck2@dyna@friction_sliding",
    "puck2@dyna@damping",
    "pusher@actuation@vel_discount",
    "env@camera@bias_x",
)
TRUTH = np.array([0.04, 0.03, -6.0, 0.85, 0.03])
SIGMA = 1e-3


def ringing(truth: float, noise: float = 0.0) -> Likelihood:
    """Ten periods: from a wrong frequency the whole of it has many minima, the first tenth one."""
    return likelihood(
        oscillation, (truth,), SHOTS, sigma=0.02, noise=noise, half_width=1.0, seconds=10.0, frames=300, seed=1
    )


def test_a_whole_trajectory_misleads_where_a_growing_horizon_does_not() -> None:
    given = ringing(0.8, noise=0.02)
    lost = minimise(given, start(given, np.zeros(1)), np.array([0]), 40).point
    assert abs(lost.values[0] - 0.8) > 0.1
    found = refine(given, np.zeros(1))
    assert found.fit.point.values[0] == pytest.approx(0.8, abs=3e-3)


def test_what_is_held_stays_until_whole_episodes_are_fitted() -> None:
    near = np.array([0.79])
    free = [float(fit.point.values[0]) for _, fit in growing(ringing(0.8), near)]
    *held, last = [float(fit.point.values[0]) for _, fit in growing(ringing(0.8), near, np.array([0]))]
    assert free[0] != near[0]
    assert held == [near[0]] * (len(free) - 1)
    assert last == pytest.approx(0.8, abs=1e-3)


def test_a_smooth_simulator_is_not_called_rough() -> None:
    """At the solution chi-square is one, and sigma as it was stated."""
    for truth in (0.3, 0.8):
        given = replace(ringing(truth, noise=0.02), prior_std=np.array([0.4]))  # it moves less than CALM sigma
        found = refine(given, np.zeros(1))
        assert found.chi_square == pytest.approx(1.0, abs=0.15)
        np.testing.assert_allclose(found.likelihood.sigma, 0.02, rtol=0.05)


def test_standard_errors_are_those_of_repeated_recordings() -> None:
    """Spread of the best value over 60 noises, each by a scalar search, against the error that one fit states."""
    given = ringing(0.3)

    def best(seed: int) -> float:
        noisy = given.measured + np.random.default_rng(seed).normal(0, 0.02, given.measured.shape)

        def squares(value: float) -> float:
            return float(np.sum((oscillation(np.full((4, 1), value), SHOTS, given.time_s) - noisy) ** 2))

        return float(minimize_scalar(squares, bounds=(0.29, 0.31), method="bounded", options={"xatol": 1e-7}).x)

    found = [best(seed) for seed in range(60)]
    free, errors = standard_errors(refine(ringing(0.3, noise=0.02), np.array([0.25])))
    assert free.tolist() == [0]
    assert errors[0] == pytest.approx(np.std(found), rel=0.35)


def test_chi_square_says_that_something_differs() -> None:
    given = ringing(0.3, noise=0.02)
    bent = replace(given, measured=given.measured + 0.1 * (given.time_s[:, :, None] > 5))
    assert refine(bent, np.zeros(1)).chi_square > 2


def test_what_the_recordings_do_not_feel_keeps_its_value() -> None:
    def predict(values: Floats, inputs: Floats, time_s: Floats) -> Floats:
        return oscillation(values[:, :1], inputs, time_s)

    given = likelihood(predict, (0.3, 0.0), SHOTS, sigma=0.02, noise=0.02, seconds=5.0, frames=100)
    found = refine(given, np.array([0.1, 0.45]))
    assert found.fit.point.values[1] == 0.45
    assert standard_errors(found)[0].tolist() == [0]


def test_a_watcher_sees_the_stages_and_can_end_the_growing() -> None:
    seen: list[tuple[str, float]] = []

    def watch(stage: str, done: float, point: Point) -> bool:
        seen.append((stage, done))
        return len(seen) < 2

    refine(ringing(0.3), np.zeros(1), watch)
    stages = [done for _, done in seen]
    assert stages == sorted(stages)
    assert stages[-1] == 1.0
    assert len([d for d in stages if d < 0.8]) == 2


@pytest.fixture(scope="module")
def table() -> tuple[Likelihood, Refined]:
    """Five strong parameters of the table at the paper's targets; three shots at 60 Hz, 1 mm of noise."""
    columns = [cell().index(name) for name in NAMES]
    shots = actions(3, seed=2)
    time = np.tile(np.arange(0, 2.5, 1 / 60), (len(shots), 1))

    def predict(values: Floats, inputs: Floats, time_s: Floats) -> Floats:
        everything = np.tile(cell().defaults, (len(values), 1))
        everything[:, columns] = values
        return simulator().observe(everything, inputs, time_s)

    clean = predict(np.tile(TRUTH, (len(shots), 1)), shots, time)
    noise = np.random.default_rng(0).normal(0, SIGMA, clean.shape)
    parameters = tuple(cell().parameters[i] for i in columns)
    given = Likelihood(
        predict=predict,
        parameters=parameters,
        inputs=shots,
        time_s=time,
        measured=clean + noise,
        sigma=np.full(clean.shape, SIGMA),
        correlation_time=1.0,
        launch_std=np.zeros(shots.shape[1]),
        prior_mean=cell().defaults[columns],
        prior_std=np.array([p.half_width for p in parameters]),
    )
    return given, refine(given, given.prior_mean)


def test_planted_parameters_of_the_table_are_found(table: tuple[Likelihood, Refined]) -> None:
    _, found = table
    assert found.chi_square < 1.2
    free, errors = standard_errors(found)
    assert free.tolist() == [0, 1, 2, 3, 4]
    assert (np.abs(found.fit.point.values - TRUTH) < 5 * errors).all()
    np.testing.assert_allclose(found.fit.point.values, TRUTH, rtol=0.1)


def test_the_fit_is_as_near_the_recording_as_the_truth_is(table: tuple[Likelihood, Refined]) -> None:
    given, found = table
    at_truth = replace(found.fit, point=Point(TRUTH, np.zeros_like(given.inputs), np.inf))
    assert chi_square(given, found.fit) < 1.02 * chi_square(given, at_truth)

"""Levenberg-Marquardt on problems with a known answer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from compass_ros.calibration.cost import Point, cost, start
from compass_ros.calibration.differences import central, linearise
from compass_ros.calibration.least_squares import Fit, lowest, minimise, normal_equations, stretched, tried
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.settle import settled
from compass_ros.types import Floats
from test.calibration.toys import likelihood, linear, oscillation

INPUTS = np.array([[1.0], [0.5], [-0.8]])
TRUTH = (0.7, -0.4, 0.3)
FREE = np.arange(3)
PLAIN = 1e4
"""A robust scale that leaves everything quadratic."""


def ridge(given: Likelihood) -> Floats:
    """(3,) the maximum a posteriori of a linear model in closed form."""
    design = np.concatenate([linear(np.eye(3), np.tile(row, (3, 1)), np.tile(t, (3, 1)))[:, :, 0].T
                             for row, t in zip(given.inputs, given.time_s, strict=True)])  # fmt: skip
    target = given.measured[:, :, 0].ravel()
    sigma = given.sigma[0, 0, 0]
    return np.asarray(np.linalg.solve(design.T @ design / sigma**2 + np.eye(3), design.T @ target / sigma**2))


def total(given: Likelihood, point: Point, robust: float) -> float:
    return float(cost(given, [point], robust)[0][0])


def test_a_quadratic_is_solved_exactly() -> None:
    given = likelihood(linear, TRUTH, INPUTS, noise=0.01)
    fit = minimise(given, start(given, np.zeros(3)), FREE, 10, PLAIN, tolerance=1e-4)
    assert fit.converged
    np.testing.assert_allclose(fit.point.values, ridge(given), atol=1e-5)
    np.testing.assert_allclose(fit.point.values, TRUTH, atol=0.05)


def test_without_data_the_prior_speaks() -> None:
    given = likelihood(linear, TRUTH, INPUTS)
    blind = replace(given, measured=np.full_like(given.measured, np.nan), prior_mean=np.array([0.1, 0.2, 0.3]))
    fit = minimise(blind, start(blind, np.ones(3)), FREE, 10, PLAIN, tolerance=1e-9)
    np.testing.assert_allclose(fit.point.values, [0.1, 0.2, 0.3], atol=1e-6)


def test_fixed_parameters_stay() -> None:
    given = likelihood(linear, TRUTH, INPUTS)
    fit = minimise(given, start(given, np.array([0.7, 0.25, 0.0])), np.array([0, 2]), 10, PLAIN)
    assert fit.point.values[1] == 0.25


def test_an_active_bound_holds_and_the_rest_is_best_for_it() -> None:
    given = likelihood(linear, TRUTH, INPUTS, bounds=(-10.0, 0.5))
    fit = minimise(given, start(given, np.zeros(3)), FREE, 20, PLAIN, tolerance=1e-9)
    assert fit.point.values[0] == 0.5
    assert (fit.point.values <= 0.5).all()
    held = minimise(given, start(given, np.array([0.5, 0, 0])), FREE[1:], 20, PLAIN, tolerance=1e-9)
    np.testing.assert_allclose(fit.point.values, held.point.values, atol=1e-4)


def test_a_nonlinear_model_is_solved_to_the_truth() -> None:
    given = likelihood(oscillation, (0.3,), INPUTS, sigma=0.01)
    fit = minimise(given, start(given, np.zeros(1)), np.array([0]), 30, PLAIN, tolerance=1e-6)
    assert fit.converged
    assert fit.point.values[0] == pytest.approx(0.3, abs=1e-3)


def test_outliers_are_ignored_by_the_robust_loss_and_not_without_it() -> None:
    given = likelihood(linear, TRUTH, INPUTS, noise=0.01)
    spoilt = given.measured.copy()
    spoilt[:, ::10] += 2.0  # a tenth of the frames swapped
    wrong = replace(given, measured=spoilt)
    robust, plain = (
        minimise(wrong, start(wrong, np.zeros(3)), FREE, 40, scale, tolerance=1e-6).point.values
        for scale in (2.0, PLAIN)
    )
    assert np.abs(robust - TRUTH).max() < 0.05
    assert np.abs(plain - TRUTH).max() > 0.15


@pytest.mark.parametrize("robust", [1.5, 1e3])
def test_the_gradient_is_that_of_the_cost(robust: float) -> None:
    """Every parameter and launch by central differences of the cost, in standard deviations of the prior."""
    given = likelihood(linear, TRUTH, INPUTS, noise=0.02, launch_std=0.1, half_width=2.0)
    rng = np.random.default_rng(3)
    point = Point(rng.normal(0, 0.5, 3), rng.normal(0, 0.05, INPUTS.shape), np.inf)
    exact = linearise(given, point, FREE, np.full(3, 1e-4))
    _, gradient = normal_equations(given, point, exact, FREE, robust)
    h = 1e-4
    numeric = np.empty(len(gradient))
    for i in range(3):
        move = np.eye(3)[i] * h * 2.0
        numeric[i] = total(given, replace(point, values=point.values + move), robust) - total(
            given, replace(point, values=point.values - move), robust
        )
    for e in range(3):
        move = np.eye(3)[e][:, None] * h * 0.1
        numeric[3 + e] = total(given, replace(point, launch=point.launch + move), robust) - total(
            given, replace(point, launch=point.launch - move), robust
        )
    np.testing.assert_allclose(gradient, numeric / (2 * h), rtol=2e-4, atol=0.05)


def test_the_hessian_of_a_quadratic_is_exact() -> None:
    given = likelihood(linear, TRUTH, INPUTS)
    point = start(given, np.zeros(3))
    hessian, gradient = normal_equations(given, point, linearise(given, point, FREE, np.ones(3)), FREE, PLAIN)
    np.testing.assert_allclose(-np.linalg.solve(hessian, gradient), ridge(given), atol=1e-6)


def test_launches_are_found_and_shrunk_towards_the_command() -> None:
    """With noise 0.1 the weight of an episode's own data against its launch's prior is known in closed form."""
    launched = INPUTS + np.array([[0.05], [-0.03], [0.08]])
    given = likelihood(linear, TRUTH, INPUTS, sigma=0.1, launched=launched, launch_std=0.04)
    known = replace(given, prior_mean=np.array(TRUTH), prior_std=np.full(3, 1e-7))
    fit = minimise(known, start(known, np.array(TRUTH)), FREE, 10, PLAIN, tolerance=1e-9)
    for e, offset in enumerate((0.05, -0.03, 0.08)):
        shape = linear(np.array([TRUTH]), np.ones((1, 1)), given.time_s[:1])[0, :, 0]
        information = np.sum(shape**2) / 0.1**2
        shrunk = offset * information / (information + 1 / 0.04**2)
        assert fit.point.launch[e, 0] == pytest.approx(shrunk, rel=1e-3)
        assert abs(fit.point.launch[e, 0]) < abs(offset)


def test_exact_launches_are_not_touched() -> None:
    given = likelihood(linear, TRUTH, INPUTS)
    assert not minimise(given, start(given, np.zeros(3)), FREE, 5).point.launch.any()


def test_running_out_of_iterations_is_said() -> None:
    given = likelihood(oscillation, (2.0,), INPUTS, sigma=0.001)
    assert not minimise(given, start(given, np.zeros(1)), np.array([0]), 1, PLAIN, tolerance=1e-12).converged


def test_central_differences_are_exact_to_second_order() -> None:
    given = likelihood(oscillation, [0.3], INPUTS)
    point, free, steps = start(given, np.array([0.3])), np.array([0]), np.array([0.05])
    phase = INPUTS[:, :1] * given.time_s
    exact = -np.cos(6.3 * phase) * phase / given.sigma[:, :, 0] * -1.0
    sides = [linearise(given, point, free, steps), central(given, point, free, steps)]
    one, two = (np.abs(side.jacobian[:, :, 0, 0] - exact).max() for side in sides)
    assert two < 0.05 * one


def rippled(values: Floats, inputs: Floats, time_s: Floats) -> Floats:
    """The linear model with ripples of a thirtieth of sigma in its parameters, as contacts make them."""
    ripple = 3e-4 * np.sin(values @ np.array([300.0, 500.0, 700.0]))
    return np.asarray(linear(values, inputs, time_s) + ripple[:, None, None] * np.cos(9 * time_s)[:, :, None])


def test_ripples_of_the_cost_do_not_hold_a_fit_that_settles() -> None:
    smooth = likelihood(linear, TRUTH, INPUTS, noise=0.01, frames=200)
    given = replace(smooth, predict=rippled)
    best = ridge(smooth)
    off = replace(start(given, best + np.array([0.02, -0.06, 0.05])), cost=np.inf)
    begun = Fit(off, linearise(given, off, FREE, np.full(3, 0.02)), FREE, PLAIN, 0, True)
    hessian, _ = normal_equations(smooth, off, begun.linear, FREE, PLAIN)
    error = np.sqrt(np.diag(np.linalg.inv(hessian)))
    assert np.abs((off.values - best) / error).max() > 3
    assert np.abs((settled(given, begun).point.values - best) / error).max() < 1


def test_a_step_through_a_valley_that_is_flatter_than_it_looks_is_stretched() -> None:
    """Where differences show eight times the curvature that is there, as the roughness of contacts lets them."""
    given = likelihood(linear, TRUTH, INPUTS, noise=0.01)
    far = start(given, np.array([0.0, 0.0, 0.0]))
    at = replace(far, cost=total(given, far, PLAIN))
    hessian, gradient = normal_equations(given, at, linearise(given, at, FREE, np.full(3, 0.02)), FREE, PLAIN)
    seeming = 8 * hessian, gradient
    short = lowest(tried(given, at, FREE, seeming, PLAIN, [1e-9]))
    assert at.cost - short.point.cost > 1.5 * short.hoped
    long = lowest(stretched(given, at, FREE, seeming, PLAIN, short))
    np.testing.assert_allclose(long.point.values, ridge(given), atol=1e-5)


def test_a_last_step_needs_no_differences_after_it() -> None:
    given, asked = likelihood(linear, TRUTH, INPUTS, noise=0.01), 0

    def counted(values: Floats, inputs: Floats, time_s: Floats) -> Floats:
        nonlocal asked
        asked += len(values) == (1 + len(FREE)) * len(INPUTS)
        return linear(values, inputs, time_s)

    fit = minimise(replace(given, predict=counted), start(given, np.zeros(3)), FREE, 10, PLAIN, tolerance=1.0)
    assert fit.converged
    assert asked == 2  # at the start, and before the last step
    best = Point(ridge(given), fit.point.launch, 0.0)
    assert total(given, fit.point, PLAIN) == pytest.approx(total(given, best, PLAIN), abs=0.1)

"""Problems with nothing to find, or nothing to find it with, end in a result: the start, or what can be known."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from compass_ros.calibration.cost import start
from compass_ros.calibration.differences import inward
from compass_ros.calibration.likelihood import HOPELESS, Likelihood
from compass_ros.calibration.refine import refine, standard_errors
from compass_ros.types import Floats
from test.calibration.toys import likelihood, linear, oscillation

SHOTS = np.array([[1.0], [0.9], [1.1], [0.8]])


def unfelt(values: Floats, inputs: Floats, times: Floats) -> Floats:
    """Moves, and no parameter has a part in it."""
    return np.asarray((inputs[:, :1] * times)[..., None])


def still(values: Floats, inputs: Floats, times: Floats) -> Floats:
    return np.zeros((*times.shape, 1))


def seen(given: Likelihood, keep: Callable[[Floats], Floats]) -> Likelihood:
    return replace(given, measured=keep(given.measured.copy()))


def without_episode(measured: Floats) -> Floats:
    measured[1] = np.nan
    return measured


def every_second_frame(measured: Floats) -> Floats:
    measured[:, ::2] = np.nan
    return measured


def late(measured: Floats) -> Floats:
    """Nothing in the first half, with which a fit begins."""
    measured[:, : measured.shape[1] // 2] = np.nan
    return measured


def bounded(given: Likelihood, low: float, high: float) -> Likelihood:
    return replace(given, parameters=tuple(replace(p, low=low, high=high) for p in given.parameters))


def without_parameters() -> Likelihood:
    given = likelihood(unfelt, (0.0,), SHOTS, noise=0.01)
    return replace(given, parameters=(), prior_mean=np.zeros(0), prior_std=np.zeros(0))


NOTHING: dict[str, Callable[[], Likelihood]] = {
    "two that are not felt": lambda: likelihood(unfelt, (0.1, 0.2), SHOTS, noise=0.01),
    "one that is not felt": lambda: likelihood(unfelt, (0.1,), SHOTS, noise=0.01),
    "not felt, launches that scatter": lambda: likelihood(unfelt, (0.1, 0.2), SHOTS, noise=0.01, launch_std=0.02),
    "hundreds that are not felt": lambda: likelihood(unfelt, (0.0,) * 130, SHOTS, noise=0.01),
    "no parameter": without_parameters,
    "bounds without room": lambda: bounded(likelihood(linear, (0.1, 0.2), SHOTS, noise=0.01), 0.0, 0.0),
    "nothing that drives": lambda: likelihood(linear, (0.1, 0.2), 0.0 * SHOTS, noise=0.01),
    "a signal that stands still": lambda: likelihood(still, (0.1, 0.2), SHOTS),
    "nothing seen": lambda: seen(likelihood(oscillation, (0.1,), SHOTS), lambda m: np.full_like(m, np.nan)),
}

LITTLE: dict[str, Callable[[], Likelihood]] = {
    "one parameter": lambda: likelihood(oscillation, (0.1,), SHOTS, noise=0.01),
    "one episode": lambda: likelihood(oscillation, (0.1,), SHOTS[:1], noise=0.01),
    "two episodes": lambda: likelihood(oscillation, (0.1,), SHOTS[:2], noise=0.01),
    "an episode without observations": lambda: seen(
        likelihood(oscillation, (0.1,), SHOTS, noise=0.01), without_episode
    ),
    "every second frame": lambda: seen(likelihood(oscillation, (0.1,), SHOTS, noise=0.01), every_second_frame),
    "seen late": lambda: seen(likelihood(oscillation, (0.1,), SHOTS, noise=0.01), late),
    "one of hundreds": lambda: likelihood(
        lambda v, i, t: linear(v[:, :1], i, t), (0.1,) + (0.0,) * 129, SHOTS, noise=0.01
    ),
    "two frames": lambda: likelihood(linear, (0.1, 0.2), SHOTS, noise=0.01, frames=2),
    "bounds narrower than a difference": lambda: bounded(
        likelihood(linear, (0.1,), SHOTS, noise=0.01, half_width=10.0), -0.12, 0.12
    ),
    "scattering launches": lambda: likelihood(oscillation, (0.1,), SHOTS, noise=0.01, launch_std=0.02),
}


@pytest.mark.parametrize("name", NOTHING)
def test_where_nothing_can_be_found_the_start_is_the_answer(name: str) -> None:
    given = NOTHING[name]()
    found = refine(given, given.prior_mean)
    assert np.array_equal(found.fit.point.values, given.prior_mean)
    assert standard_errors(found)[0].size == found.alone.size == 0
    assert np.isfinite(found.chi_square)


@pytest.mark.parametrize("name", LITTLE)
def test_little_is_enough_for_one_number(name: str) -> None:
    given = LITTLE[name]()
    found = refine(given, given.prior_mean)
    free, errors = standard_errors(found)
    assert 0 in free
    assert abs(found.fit.point.values[0] - 0.1) < 4 * errors[0]
    assert errors[0] < 0.1


@pytest.mark.parametrize("bound", [-0.05, 0.05])
def test_a_truth_beyond_the_bounds_ends_at_the_bound(bound: float) -> None:
    given = bounded(likelihood(linear, (20 * bound, 20 * bound), SHOTS, noise=0.01), -0.05, 0.05)
    assert np.array_equal(refine(given, given.prior_mean).fit.point.values, [bound, bound])


@pytest.mark.parametrize("lost", [np.nan, np.inf, -np.inf, 1e300])
@pytest.mark.parametrize("beyond", [0.15, 0.25, 0.5])
def test_a_simulator_that_loses_the_body_is_not_taken_for_one_that_agrees(lost: float, beyond: float) -> None:
    def predict(values: Floats, inputs: Floats, times: Floats) -> Floats:
        return np.where(values[:, :1, None] > beyond, lost, linear(values, inputs, times))

    given = replace(likelihood(linear, (0.1, 0.2), SHOTS, noise=0.01), predict=predict)
    gone = given.residual(np.array([[2 * beyond, 0.2]]), SHOTS[:1], np.array([0]))
    assert (np.abs(gone) == HOPELESS).all()
    found = refine(given, given.prior_mean)
    np.testing.assert_allclose(found.fit.point.values, [0.1, 0.2], atol=0.02)


def test_what_was_not_measured_stays_without_a_residual() -> None:
    given = seen(likelihood(linear, (0.1, 0.2), SHOTS), every_second_frame)
    gone = replace(given, predict=lambda v, i, t: np.full((*t.shape, 1), np.nan))
    missed = gone.residual(np.zeros((4, 2)), SHOTS, np.arange(4))
    assert (missed[:, ::2] == 0).all()
    assert (missed[:, 1::2] == HOPELESS).all()


@pytest.mark.parametrize(
    ("value", "low", "high", "step"),
    [
        (0.0, -1.0, 1.0, 0.3),
        (0.9, -1.0, 1.0, -0.3),
        (-0.9, -1.0, 1.0, 0.3),
        (0.05, -0.1, 0.1, -0.15),
        (-0.05, -0.1, 0.1, 0.15),
        (0.1, 0.0, 0.1, -0.1),
        (0.1, 0.1, 0.1, 0.0),
    ],
)
def test_differences_are_taken_inside_the_bounds(value: float, low: float, high: float, step: float) -> None:
    given = bounded(likelihood(linear, (0.0,), SHOTS), low, high)
    change = inward(given, start(given, np.array([value])), np.array([0]), np.array([0.3]))
    assert change[0] == pytest.approx(step)

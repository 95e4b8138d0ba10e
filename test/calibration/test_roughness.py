"""A thrown block whose landing kicks it by another amount after every smallest change: planted roughness."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from compass_ros.calibration.cost import ROBUST, start
from compass_ros.calibration.differences import linearise
from compass_ros.calibration.least_squares import Fit
from compass_ros.calibration.likelihood import SMOOTH, Likelihood
from compass_ros.calibration.refine import refine, standard_errors
from compass_ros.calibration.roughness import REFITS, gains_by_chance, with_rough_starts, with_roughness
from compass_ros.types import Floats
from test.calibration.toys import likelihood

KICK = 0.01
"""Standard deviation of the kick [m/s]."""
TRUE = 4.7
LANDING_S = 0.1
SIGMA = 1e-3
BEGUN = np.array([[v, 0.0] for v in np.linspace(2.0, 3.4, 12)])
"""First speeds [m/s] and heights [m]."""


def block(kick: float) -> Likelihood:
    """Its deceleration is the parameter; first speeds are known to 0.1 m/s, heights to 1 mm; frames to 1 mm."""

    def predict(values: Floats, inputs: Floats, time_s: Floats) -> Floats:
        chance = np.sin(1e7 * (values.sum(axis=1) + inputs @ [1.0, 3.0])) * np.sqrt(2)
        slid = inputs[:, :1] * time_s - 0.5 * values[:, :1] * time_s**2
        return np.asarray((slid + kick * chance[:, None] * np.maximum(time_s - LANDING_S, 0.0))[:, :, None])

    off = np.random.default_rng(1).normal(0, [0.1, 1e-3], BEGUN.shape)
    given = likelihood(predict, [TRUE], BEGUN, sigma=SIGMA, noise=SIGMA, launched=BEGUN + off, half_width=0.5)
    return replace(given, prior_mean=np.array([4.2]), launch_std=np.array([0.1, 1e-3]))


def planted(given: Likelihood) -> Floats:
    return np.asarray(KICK * np.maximum(given.time_s[0] - LANDING_S, 0.0))


def test_first_states_show_how_rough_the_landing_is() -> None:
    given = block(KICK)
    found = with_rough_starts(given, start(given, given.prior_mean))
    assert found.rough is not None
    spread = np.sqrt(np.mean(found.rough[:, :, 0] ** 2, axis=0))
    np.testing.assert_allclose(spread, planted(given), rtol=0.35, atol=1e-9)
    np.testing.assert_allclose(found.sigma, np.hypot(given.sigma, found.rough))


def test_what_was_known_of_it_is_replaced_and_not_added_to() -> None:
    given = block(KICK)
    once = with_rough_starts(given, start(given, given.prior_mean))
    again = with_rough_starts(once, start(given, given.prior_mean))
    np.testing.assert_allclose(again.sigma, once.sigma)


def test_a_smooth_landing_is_not_rough() -> None:
    given = block(0.0)
    found = with_rough_starts(given, start(given, given.prior_mean))
    assert found.smooth
    assert found.roughness < SMOOTH / 10


@pytest.mark.parametrize("kick", [0.0, KICK])
def test_a_fit_shows_it_too(kick: float) -> None:
    given = block(kick)
    point, free = start(given, np.array([TRUE])), np.arange(1)
    fit = Fit(point, linearise(with_rough_starts(given, point), point, free, np.ones(1)), free, ROBUST, 0, True)
    found = with_roughness(with_rough_starts(given, point), fit)
    assert found.rough is not None
    spread = np.sqrt(np.mean(found.rough[:, -1, 0] ** 2))
    assert spread == pytest.approx(np.sqrt(2) * planted(given)[-1] if kick else 0.0, rel=0.4, abs=1e-5)  # of two kicks


@pytest.mark.parametrize("kick", [0.0, KICK])
def test_another_start_is_worth_what_the_landing_makes_of_it(kick: float) -> None:
    """Of two fits on the same recordings one is the better by chance; of smooth throws both are alike."""
    given = block(kick)
    refined = refine(given, np.array([TRUE]))
    gains = gains_by_chance(refined.likelihood, refined.fit)
    assert gains.shape == (REFITS,)
    assert np.ptp(gains) > 1 if kick else np.abs(gains).max() < 0.01


def test_differences_of_a_first_state_see_past_it() -> None:
    """A height that does nothing but kick: over a tenth of its deviation that looks like ten times as much."""
    given = block(KICK)
    point = start(given, np.array([TRUE]))
    blind = linearise(given, point, np.arange(1), np.ones(1)).launch_jacobian[..., 1]
    seen = linearise(with_rough_starts(given, point), point, np.arange(1), np.ones(1)).launch_jacobian[..., 1]
    rough = with_rough_starts(given, point).sigma / given.sigma
    assert np.sqrt(np.mean((seen * rough) ** 2)) < 0.5 * np.sqrt(np.mean(blind**2))


@pytest.mark.parametrize("begun", [3.7, 4.2, 4.7, 5.2])
def test_the_parameter_is_found_from_anywhere_and_its_error_is_not_that_of_smooth_throws(begun: float) -> None:
    """Kicks leave 2 KICK / sqrt(12) open; the frames' noise alone would leave a fifth of that."""
    refined = refine(block(KICK), np.array([begun]))
    _, (error,) = standard_errors(refined)
    assert abs(refined.fit.point.values[0] - TRUE) < 5 * KICK
    assert refined.chi_square < 1.5
    assert 0.1 * KICK < error < 10 * KICK

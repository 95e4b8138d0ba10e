"""No fit ends farther from what was fitted than it began, in the distance that is reported."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from compass_ros.calibration.causal_map import causal_map_refined
from compass_ros.calibration.launches import with_launches
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.problem import Problem
from compass_ros.calibration.refine import refine, standard_errors
from compass_ros.calibration.safeguard import left_in_few
from compass_ros.types import Floats, Ints, silent
from test.calibration.toys import likelihood, oscillation

SHOTS = np.array([[1.0], [0.9], [1.1], [0.8]])


def distance(given: Likelihood, values: Floats) -> float:
    """rms of all that was seen, in its unit, each episode with the launch that agrees best with it."""
    inputs = given.inputs + with_launches(given, values).launch
    missed = given.predict(np.tile(values, (len(inputs), 1)), inputs, given.time_s) - given.measured
    return float(np.sqrt(np.nanmean(missed**2)))


def problem(given: Likelihood) -> Problem:
    """The whole of it, with the rms as the one factor."""

    def trajectories(values: Floats, episodes: Ints) -> Floats:
        return given.predict(values, given.inputs[episodes], given.time_s[episodes])

    def differences(values: Floats, episodes: Ints) -> Floats:
        apart = np.abs(trajectories(values, episodes) - given.measured[episodes])
        return np.asarray(np.nansum(apart, axis=(1, 2))[:, None])

    return Problem(
        differences=differences,
        trajectories=trajectories,
        measured=np.nan_to_num(given.measured),
        weight=np.where(np.isnan(given.measured), 0.0, 1 / given.sigma),
        actions=given.inputs,
        parameters=given.parameters,
        factors=("all",),
        start=given.prior_mean,
        simulated_seconds=1.0,
        apart=lambda one, other: np.abs(one - other).sum(axis=-1, keepdims=True),
        distance=lambda values: distance(given, values),
        likelihood=given,
    )


def misled() -> Likelihood:
    """Ten periods, of which only the first one goes faster than the simulator's."""
    given = likelihood(oscillation, (0.0,), SHOTS, sigma=0.02, half_width=1.0, seconds=10.0, frames=300)
    fast = oscillation(np.full((4, 1), 2.0), SHOTS, given.time_s)
    return replace(given, measured=np.where(given.time_s[..., None] < 1.8, fast, given.measured))


def amplified(values: Floats, inputs: Floats, times: Floats) -> Floats:
    """Where the parameter says what it should, and a few last frames that it throws far off."""
    out = inputs * values[:, :1] * np.ones_like(times)
    out[:, -3:] *= 25
    return np.asarray(out[..., None])


def few_against_many(launch_std: float = 0.0) -> Likelihood:
    given = likelihood(amplified, (1.0,), SHOTS, sigma=1e-3, half_width=0.5, frames=120, launch_std=launch_std)
    measured = given.measured.copy()
    measured[:, -3:] = 0.0
    return replace(given, measured=measured)


def two_columns(values: Floats, inputs: Floats, times: Floats) -> Floats:
    return np.stack([values[:, :1] + 0 * times, 5 * values[:, :1] + 0 * times], axis=-1)


def exact_against_coarse() -> Likelihood:
    """An offset that an exact sensor shows; a coarse one beside it, in the same unit, was right without it."""
    given = likelihood(two_columns, (0.02,), SHOTS, half_width=0.05)
    measured, sigma = given.measured.copy(), given.sigma.copy()
    measured[..., 1], sigma[..., 0], sigma[..., 1] = 0.0, 1e-4, 0.1
    return replace(given, measured=measured, sigma=sigma)


def logistic(values: Floats, inputs: Floats, times: Floats) -> Floats:
    """A chaotic map: one wrong digit is another trajectory after twenty frames."""
    x, out = 0.2 + 0.1 * inputs[:, 0], np.empty((len(values), times.shape[1], 1))
    rate = np.clip(3.7 + values[:, 0], 0.0, 4.0)
    for frame in range(times.shape[1]):
        out[:, frame, 0] = x
        x = rate * x * (1 - x) + np.clip(values[:, 1], -0.05, 0.05) * np.sin(frame)
        x = np.clip(x, 0.0, 1.0)
    return out


def chaotic(seed: int) -> Likelihood:
    """Recordings of another map than the simulator's, which begins near to them."""
    given = likelihood(logistic, (0.0, 0.0), SHOTS, sigma=1e-3, noise=1e-3, half_width=0.1, frames=40, seed=seed)
    rng = np.random.default_rng(seed)
    bent = given.measured + 0.15 * np.sin(rng.uniform(2, 9) * given.measured) * (given.time_s[..., None] > 0.3)
    return replace(given, measured=bent)


FARTHER: dict[str, Callable[[], Likelihood]] = {
    "beginnings that mislead": misled,
    "few amplified frames against many": few_against_many,
    "the same with launches that scatter": lambda: few_against_many(1e-4),
    "an exact sensor against a coarse one": exact_against_coarse,
    "lost frames on one side": lambda: replace(
        few_against_many(),
        measured=np.where(few_against_many().time_s[..., None] < 0.02, 9.0, few_against_many().measured),
    ),
}


@pytest.mark.parametrize("name", FARTHER)
def test_a_fit_that_would_end_farther_is_not_kept(name: str) -> None:
    given = FARTHER[name]()
    begun = distance(given, given.prior_mean)
    assert distance(given, refine(given, given.prior_mean).fit.point.values) > 1.05 * begun, "the premise"
    estimate, kept = causal_map_refined(problem(given), silent)
    assert distance(given, estimate.values) <= begun
    assert np.array_equal(estimate.values, kept.fit.point.values)
    assert np.array_equal(estimate.trace[-1].values, estimate.values)
    assert "times as far from the fitted episodes (rms) as the defaults are" in estimate.note
    free, errors = standard_errors(kept)
    assert np.isfinite(errors).all()
    assert np.array_equal(estimate.std[free], errors)


@pytest.mark.parametrize("seed", range(12))
def test_in_chaos_no_fit_ends_farther(seed: int) -> None:
    given = chaotic(seed)
    estimate, _ = causal_map_refined(problem(given), silent)
    assert distance(given, estimate.values) <= distance(given, given.prior_mean)


def test_a_fit_that_came_nearer_is_the_one_that_is_returned() -> None:
    """Bit for bit, and nothing is said."""
    given = likelihood(oscillation, (0.3,), SHOTS, sigma=0.02, noise=0.02)
    alone = refine(given, given.prior_mean)
    estimate, kept = causal_map_refined(problem(given), silent)
    assert np.array_equal(estimate.values, alone.fit.point.values)
    assert np.array_equal(kept.covariance, alone.covariance)
    assert estimate.note == ""


def test_what_the_whole_episodes_show_is_found_where_their_beginnings_mislead() -> None:
    """From the start, half a period away at the end, the nearest optimum is the truth."""
    given = misled()
    moved = replace(given, prior_mean=np.array([0.1]))
    estimate, _ = causal_map_refined(problem(moved), silent)
    assert estimate.values[0] == pytest.approx(0.0, abs=0.02)
    assert "one that begins with whole episodes is at" in estimate.note


def test_episodes_that_hold_most_of_what_is_left_are_named() -> None:
    """Two of forty, of which one holds half of it; not where all hold as much, nor where noise is all that is left."""
    given = likelihood(oscillation, (0.0,), np.ones((40, 1)))
    names = [f"shot {i}" for i in range(40)]
    noise = np.random.default_rng(0).normal(size=given.measured.shape)
    assert left_in_few(given, noise, names) == ""
    assert left_in_few(given, 3 * noise, names) == ""
    noise[7] += 10.0
    noise[31] += 5.0
    found = "80 % of what the fit leaves above the noise is in 1 of 40 episodes: shot 7"
    assert left_in_few(given, noise, names) == found
    noise[32] += 10.0
    assert left_in_few(given, noise, names).endswith(
        "89 % of what the fit leaves above the noise is in 2 of 40 episodes: shot 32, shot 7"
    )

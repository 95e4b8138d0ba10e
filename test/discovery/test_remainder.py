"""What is missing is told from noise without knowing the noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from compass_ros.calibration.least_squares import Fit, Linear, cost, start
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.noise import correlated, correlation_time
from compass_ros.discovery.remainder import noise_cost, noise_level, smooth_excess
from compass_ros.types import Floats

EPISODES, FRAMES, COLUMNS = 12, 150, 4
ROBUST = 4.0


def recordings(noise: Floats, missing: float, correlation_time: float) -> Likelihood:
    """A model that predicts zero; what is missing is a slow wave of rms `missing` sigma."""
    time = np.tile(np.arange(FRAMES) / 60.0, (EPISODES, 1))
    wave = missing * np.sqrt(2) * np.sin(2 * np.pi * time)[:, :, None]
    return Likelihood(
        predict=lambda values, inputs, time_s: np.zeros((len(values), time_s.shape[1], COLUMNS)),
        parameters=(),
        inputs=np.zeros((EPISODES, 1)),
        time_s=time,
        measured=noise + wave,
        sigma=np.ones_like(noise),
        correlation_time=correlation_time,
        launch_std=np.zeros(1),
        prior_mean=np.zeros(0),
        prior_std=np.zeros(0),
    )


def white(seed: int) -> Floats:
    return np.random.default_rng(seed).normal(size=(EPISODES, FRAMES, COLUMNS))


def left(of: Likelihood) -> float:
    return smooth_excess(of, start(of, np.zeros(0)), ROBUST)


@pytest.mark.parametrize("louder", [0.8, 1.0, 1.2])
@pytest.mark.parametrize("missing", [0.0, 0.3, 1.0])
def test_a_noise_that_is_judged_wrongly_does_not_matter(louder: float, missing: float) -> None:
    found = [left(recordings(louder * white(seed), missing, 1.0)) for seed in range(5)]
    assert np.mean(found) == pytest.approx(missing**2, abs=0.01 + 0.2 * missing**2)  # the robust loss counts less


def test_correlated_noise_is_no_excess() -> None:
    noise = white(0)
    for frame in range(1, FRAMES):
        noise[:, frame] = 0.6 * noise[:, frame - 1] + 0.8 * noise[:, frame]
    assert left(recordings(noise, 0.0, 4.0)) == pytest.approx(0.0, abs=0.05)


def test_lost_frames_do_not_matter() -> None:
    given = recordings(white(1), 0.5, 1.0)
    gone = np.random.default_rng(2).random((EPISODES, FRAMES)) < 0.2
    holes = replace(given, measured=np.where(gone[:, :, None], np.nan, given.measured))
    assert left(holes) == pytest.approx(0.25, abs=0.04)


def level(of: Likelihood) -> float:
    nothing = Linear(np.zeros_like(of.measured), *(np.zeros(0),) * 3)
    return noise_level(of, Fit(start(of, np.zeros(0)), nothing, np.zeros(0, np.int64), ROBUST, 0, True))


@pytest.mark.parametrize("missing", [0.0, 2.0])
@pytest.mark.parametrize("correlation", [0.0, 0.6])
def test_what_motion_adds_to_the_noise_at_rest_is_seen_beside_what_is_missing(
    correlation: float, missing: float
) -> None:
    still = correlated(white(0), correlation)
    known = correlation_time(correlation)
    assert level(recordings(still, missing, known)) == 1.0
    shaken = recordings(still + np.sqrt(0.5) * white(1), missing, known)
    assert level(shaken) == pytest.approx(1.5, abs=0.1)


def test_frames_after_the_fit_has_lost_a_body_say_nothing_of_the_noise() -> None:
    given = recordings(white(0), 0.0, 1.0)
    lost = given.measured.copy()
    lost[:6, 50:] += 30.0 * (np.arange(FRAMES - 50) % 7)[:, None]
    assert level(replace(given, measured=lost)) == 1.0


def test_the_cost_of_unit_noise_is_what_unit_noise_costs() -> None:
    given = recordings(white(0), 0.0, 1.0)
    found = cost(given, [start(given, np.zeros(0))], ROBUST)[0][0]
    assert noise_cost(given, ROBUST) == pytest.approx(found, rel=0.02)
    doubted = replace(given, sigma=np.where(np.arange(FRAMES)[:, None] < 75, 1.0, 10.0) * np.ones_like(given.sigma))
    assert noise_cost(doubted, ROBUST) == pytest.approx(0.505 * noise_cost(given, ROBUST), rel=0.01)

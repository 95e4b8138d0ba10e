"""Noise found in recordings without any simulator: still frames, flight, outliers, gaps."""

from __future__ import annotations

import numpy as np
import pytest

from compass_ros.calibration.noise import correlated, integrated_correlation_time, measure_noise
from compass_ros.types import Floats

RATE = 60.0
EPISODES, STILL, MOVING = 12, 60, 120


def recording(sigma: Floats, correlation: float = 0.0, still: int = STILL, seed: int = 0) -> tuple[Floats, Floats]:
    """Times and measurements: at rest before the command, then a parabola in each column; AR(1) noise."""
    frames = still + MOVING
    time = np.tile((np.arange(frames) - still) / RATE, (EPISODES, 1))
    moving = np.clip(time, 0, None)[:, :, None]
    rng = np.random.default_rng(seed)
    motion = rng.normal(0, 0.3, (EPISODES, 1, len(sigma))) * moving - 0.1 * moving**2
    white = rng.normal(size=motion.shape)
    noise = np.empty_like(white)
    noise[:, 0] = white[:, 0]
    for f in range(1, frames):
        noise[:, f] = correlation * noise[:, f - 1] + np.sqrt(1 - correlation**2) * white[:, f]
    return time, rng.normal(0, 0.1, (EPISODES, 1, len(sigma))) + motion + noise * sigma


@pytest.mark.parametrize("correlation", [0.0, 0.4, 0.7])
def test_sigma_and_correlation_are_found_from_still_frames(correlation: float) -> None:
    sigma = np.array([0.5e-3, 1e-3, 0.5e-3, 2e-3])
    found = measure_noise(*recording(sigma, correlation), expected=0.02)
    np.testing.assert_allclose(found.sigma, sigma, rtol=0.12)
    assert found.correlation == pytest.approx(correlation, abs=0.06)
    assert found.correlation_time == pytest.approx((1 + correlation) / (1 - correlation), rel=0.25)


def test_without_still_frames_the_flight_says_it() -> None:
    sigma = np.array([1e-3, 3e-3])
    found = measure_noise(*recording(sigma, still=0), expected=0.02)
    np.testing.assert_allclose(found.sigma, sigma, rtol=0.1)


def test_with_neither_the_expected_noise_is_taken() -> None:
    time, measured = recording(np.array([1e-3]), still=0)
    found = measure_noise(time[:, :5], measured[:, :5], expected=0.004)
    np.testing.assert_array_equal(found.sigma, [0.004])
    assert found.correlation == 0


def test_outliers_and_gaps_hardly_matter() -> None:
    time, measured = recording(np.array([1e-3, 1e-3]), 0.4)
    rng = np.random.default_rng(1)
    measured[rng.random(measured.shape) < 0.007] += 0.008
    measured[rng.random(measured.shape[:2]) < 0.05] = np.nan
    found = measure_noise(time, measured, expected=0.02)
    np.testing.assert_allclose(found.sigma, 1e-3, rtol=0.15)
    assert found.correlation == pytest.approx(0.4, abs=0.12)


def test_a_tracker_that_is_worse_in_motion_is_judged_in_motion() -> None:
    time, measured = recording(np.array([0.3e-3]))
    measured[:, STILL:] += np.random.default_rng(2).normal(0, 2e-3, (EPISODES, MOVING, 1))
    found = measure_noise(time, measured, expected=0.02).sigma[0]
    assert 0.9e-3 < found < 2.2e-3  # a median over all frames, of which a third are still


def test_perfect_recordings_keep_sigma_positive() -> None:
    assert (measure_noise(*recording(np.zeros(2)), expected=0.02).sigma > 0).all()


def test_columns_that_are_alike_are_judged_together() -> None:
    """Eight still frames a shot: 84 measurements a column say sigma to 8 %, all columns in rest and flight to 2 %."""
    found = [measure_noise(*recording(np.full(4, 1e-3), still=8, seed=seed), expected=0.02).sigma for seed in range(10)]
    assert np.ptp(found, axis=1).max() == 0
    assert np.std(found) < 0.03e-3
    assert np.mean(found) == pytest.approx(1e-3, rel=0.015)


@pytest.mark.parametrize(("slow", "correlation"), [(0.0, 0.0), (1.0, 0.5), (0.15, 0.9), (0.3, 0.95)])
def test_what_is_slow_beside_white_noise_counts_over_all_lags(slow: float, correlation: float) -> None:
    """Variance of a mean of white noise and an AR(1) process: (1 + slow (1 + r) / (1 - r)) / n."""
    rng = np.random.default_rng(0)
    shape = (9, 150, 4)
    seen = rng.random(shape) > 0.1
    times = []
    for _ in range(20):
        residual = rng.standard_normal(shape) + np.sqrt(slow) * correlated(rng.standard_normal(shape), correlation)
        times.append(integrated_correlation_time(np.where(seen, residual, 99.0), seen))
    expected = (1 + slow * (1 + correlation) / (1 - correlation)) / (1 + slow)
    assert np.mean(times) == pytest.approx(expected, rel=0.1)


BODIES = ((0, 1), (2, 3))


def swaying(time: Floats, size: float, frequency: float) -> Floats:
    """(E, F, 4) of a camera's mast over two bodies; episodes begin at any phase of it."""
    phase = np.random.default_rng(3).uniform(0, 6.28, (EPISODES, 1))
    swing = size * np.sin(2 * np.pi * frequency * time + phase)
    return np.stack([0.4 * swing, swing, 0.4 * swing, swing], axis=2)


@pytest.mark.parametrize("still", [0, 20])
@pytest.mark.parametrize("frequency", [3.5, 11.0])
def test_what_two_bodies_do_together_is_no_noise_of_theirs(frequency: float, still: int) -> None:
    time, measured = recording(np.full(4, 1e-3), still=still)
    measured += swaying(time, 7e-3, frequency)
    found = measure_noise(time, measured, 0.02, bodies=BODIES)
    apart = measure_noise(time, measured, 0.02)
    assert np.all(found.sigma < 1.5e-3)  # a body's noise and that of the one it is compared with
    assert found.correlation < 0.3
    assert apart.sigma.max() > 2e-3 or still == 0  # in flight a slow sway is motion, not noise


@pytest.mark.parametrize("correlation", [0.0, 0.9])
def test_bodies_with_noise_of_their_own_have_nothing_in_common(correlation: float) -> None:
    """Two AR(1) processes of 20 frames seem to correlate; what is new in each frame does not."""
    for seed in range(30):
        given = recording(np.full(4, 1e-3), correlation, still=20, seed=seed)
        np.testing.assert_array_equal(
            measure_noise(*given, 0.02, bodies=BODIES).sigma, measure_noise(*given, 0.02).sigma
        )

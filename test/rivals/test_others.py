"""The Gaussian process learns a smooth residual; sbi's p-value is uniform where the simulator is right."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import kstest

from compass_ros.calibration.rivals.misspecification import misspecification_p
from compass_ros.rivals.calibrated import Calibrated, Shots, rms
from compass_ros.rivals.gaussian_process import gaussian_process
from compass_ros.rivals.well_specified import observed_and_simulated
from test.rivals.planted import played


def bent(shots: Shots) -> Shots:
    """Recordings that a camera has moved by up to 4 mm, depending on the place."""
    x, y = shots.paths[..., 0], shots.paths[..., 1]
    moved = 4e-3 * np.stack([np.sin(5 * x), np.cos(8 * y)], axis=-1).reshape(shots.predicted.shape)
    return replace(shots, data=replace(shots.data, measured=shots.data.measured + moved))


@pytest.mark.nightly
def test_a_gaussian_process_learns_a_smooth_residual() -> None:
    plain = played()
    given = replace(plain, fit=bent(plain.fit), held_out=bent(plain.held_out))
    measured = given.held_out.data.measured
    floor = rms(plain.held_out.predicted, plain.held_out.data.measured)
    before, after = rms(given.held_out.predicted, measured), rms(gaussian_process(given), measured)
    assert before > 2 * floor
    assert after - floor < 0.4 * (before - floor)


@pytest.mark.slow
def test_a_gaussian_process_leaves_noise_alone() -> None:
    given = played()
    measured = given.held_out.data.measured
    assert rms(gaussian_process(given), measured) < 1.03 * rms(given.held_out.predicted, measured)


@pytest.mark.nightly
def test_the_p_value_is_uniform_where_the_simulator_is_right() -> None:
    rng = np.random.default_rng(0)
    simulated = rng.standard_normal((300, 8))
    ps = [misspecification_p(rng.standard_normal((12, 8)), simulated, seed, shuffles=100) for seed in range(60)]
    assert kstest(ps, "uniform").pvalue > 0.01


def test_the_p_value_falls_where_it_is_wrong_and_repeats() -> None:
    rng = np.random.default_rng(1)
    simulated, observed = rng.standard_normal((300, 8)), rng.standard_normal((12, 8)) + 1.0
    assert misspecification_p(observed, simulated, 0, shuffles=100) < 0.05
    p = misspecification_p(observed - 1.0, simulated, 3, shuffles=100)
    assert misspecification_p(observed - 1.0, simulated, 3, shuffles=100) == p


def p_value(given: Calibrated) -> float:
    return misspecification_p(*observed_and_simulated(given, seed=0, draws=30), seed=0, shuffles=200)


@pytest.mark.nightly
def test_recordings_of_the_simulator_itself_raise_no_alarm_and_others_do() -> None:
    assert p_value(played()) > 0.05
    assert p_value(played([("viscous_drag", ("puck1", "puck2"), [0.1])])) < 0.05

"""A shot that the plain simulator has lost does not outweigh the others; an outlier or a missing frame is no loss."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from compass_ros.calibration.least_squares import minimise, start
from compass_ros.calibration.refine import ROBUST, refine
from compass_ros.discovery.followed import LOST, doubted, followed
from compass_ros.discovery.planned import perfect
from compass_ros.types import Floats
from test.discovery.planted import CALM, FREE, HELD_OUT, RATE, SIGMA, recorded
from test.simulation.table import cell, simulator

SHOTS = np.concatenate([CALM, HELD_OUT])


def test_frames_after_a_loss_count_as_much_as_the_limit_and_never_more_again() -> None:
    likelihood = perfect(simulator(), CALM, RATE, SIGMA)
    residual = np.ones(likelihood.measured.shape)
    residual[1, 40:55] = 3 * LOST
    doubt = doubted(likelihood, residual)
    assert np.all(doubt[[0, 2]] == 1.0)
    assert np.all(doubt[1, :35] == 1.0)
    assert np.allclose(doubt[1, 45:], 3.0), "what was lost stays lost, though it comes near again"


def test_an_outlier_and_missing_frames_are_no_loss() -> None:
    likelihood = perfect(simulator(), CALM, RATE, SIGMA)
    measured = likelihood.measured.copy()
    measured[0, 10:30] = np.nan
    residual = np.ones(measured.shape)
    residual[1, 20:23] = 100.0
    assert np.all(doubted(replace(likelihood, measured=measured), residual) == 1.0)


@pytest.mark.slow
def test_what_is_followed_stays_as_it_is() -> None:
    refined = refine(recorded(None, [], SHOTS), simulator().defaults)
    likelihood, fit = followed(refined.likelihood, refined.fit)
    assert likelihood is refined.likelihood
    assert fit is refined.fit


def test_a_lost_shot_no_longer_bends_the_parameters() -> None:
    likelihood = recorded(None, [], SHOTS)
    measured = likelihood.measured.copy()
    measured[3, 50:] += np.linspace(0.0, 0.12, measured.shape[1] - 50)[:, None]
    bent = replace(likelihood, measured=measured)
    free = np.array([cell().index(name) for name in FREE])
    fit = minimise(bent, start(bent, simulator().defaults), free, 8, ROBUST)

    def off(values: Floats) -> float:
        return float(np.linalg.norm((values - simulator().defaults)[free] / likelihood.prior_std[free]))

    weighted, mended = followed(bent, fit)
    assert np.all(weighted.sigma[[0, 1, 2, 4]] == bent.sigma[[0, 1, 2, 4]])
    assert off(mended.point.values) < 0.5 * off(fit.point.values)

"""What is left is called noise only where episodes that were never fitted say so too."""

from __future__ import annotations

from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

from compass_ros.calibration.cost import start
from compass_ros.calibration.differences import Linear
from compass_ros.calibration.least_squares import Fit
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.noise import Noise
from compass_ros.discovery.floor import TWICE, honest, left_open, shown_noise
from compass_ros.discovery.nuisances import nuisances
from compass_ros.types import Floats, Mismatch, Verdict
from test.discovery.planted import recorded, response_of

EPISODES, FRAMES, COLUMNS = 12, 150, 4
ROBUST = 4.0
KNOWN = Noise(np.ones(COLUMNS), 0.0)


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


def shown(given: Likelihood, noise: Noise = KNOWN) -> Floats:
    nothing = Linear(np.zeros_like(given.measured), *(np.zeros(0),) * 3)
    fit = Fit(start(given, np.zeros(0)), nothing, np.zeros(0, np.int64), ROBUST, 0, True)
    return shown_noise(noise, given, fit).rms


def test_what_follows_the_motion_is_no_noise() -> None:
    np.testing.assert_allclose(shown(recordings(white(0), 1.5, 1.0)), 1.0, rtol=0.05)


def test_outliers_blur_and_lost_frames_are() -> None:
    """Five kinds of what changes from frame to frame, each with the rms that it was made with."""
    rng = np.random.default_rng(3)
    far = white(0) + 20.0 * (rng.random((EPISODES, FRAMES, COLUMNS)) < 0.01)
    one_column = white(0) * np.array([1.0, 3.0, 1.0, 1.0])
    kinds = {
        "outliers": (far, None),
        "louder": (2.5 * white(0), 2.5),
        "one column": (one_column, [1, 3, 1, 1]),
        "steps": (np.round(white(0) / 5) * 5 + rng.uniform(-2.5, 2.5, white(0).shape), None),
        "heavy tails": (rng.standard_t(3, white(0).shape) * 1.5, None),
    }
    for name, (noise, expected) in kinds.items():
        rms = np.sqrt(np.mean(np.square(noise), axis=(0, 1))) if expected is None else expected
        np.testing.assert_allclose(shown(recordings(noise, 1.0, 1.0)), rms, rtol=0.12, err_msg=name)


def test_what_is_not_seen_says_nothing() -> None:
    given = recordings(3.0 * white(0), 0.0, 1.0)
    gone = np.random.default_rng(2).random((EPISODES, FRAMES)) < 0.3
    holes = replace(given, measured=np.where(gone[:, :, None], np.nan, given.measured))
    np.testing.assert_allclose(shown(holes), 3.0, rtol=0.1)


@pytest.mark.parametrize("verdict", get_args(Verdict))
@pytest.mark.parametrize("error", [0.5, 1.9, 2.0, 1e9, float("inf")])
def test_no_published_answer_says_none_beside_such_an_error(verdict: Verdict, error: float) -> None:
    said = honest(Mismatch(verdict, None, (), (), "", "as it was"), error, 1.0)
    assert (said.verdict == "none") == (verdict == "none" and error < TWICE)
    assert said.verdict == verdict or (verdict, said.verdict) == ("none", "unknown")


@pytest.mark.parametrize(
    ("error", "open_sigma", "verdict"), [(3.0, 0.0, "unknown"), (3.0, 2.0, "none"), (9.0, 2.0, "unknown")]
)
def test_what_the_error_bars_of_parameters_leave_open_is_no_error_of_the_model(
    error: float, open_sigma: float, verdict: str
) -> None:
    said = honest(Mismatch("none", None, (), (), "", "Nothing is missing."), error, 1.0, open_sigma)
    assert said.verdict == verdict
    assert f"{error:.1f} times the noise" in said.sentence
    beside = honest(Mismatch("named", None, (), (), "", "A spring is missing."), error, 1.0, open_sigma)
    assert beside.verdict == "named"
    assert ("More is missing" in beside.sentence) == (verdict == "unknown")
    assert f"{error:.1f} times the noise" in beside.sentence


def test_what_is_left_open_has_the_error_bars_and_the_numerics_at_the_verdicts_alpha() -> None:
    """Oracle: without error bars, the root mean square of normal draws of the nuisances of the evidence itself."""
    response = response_of(recorded(None, []))
    simulator, fit, likelihood = response.simulator, response.fit, response.likelihood
    none, wide = np.zeros((len(fit.free),) * 2), 0.01 * np.eye(len(fit.free))
    engine = nuisances(simulator, likelihood, fit)
    once = [left_open(simulator, fit, none, likelihood, 0.5, seed) for seed in range(40)]
    seen = ~np.isnan(likelihood.measured)
    step = 1 + simulator.places.touching  # the first of them is one of each episode as well
    expected = np.mean([step * engine[..., 0][seen] ** 2 + np.sum(engine[..., 1:][seen] ** 2, axis=1)])
    assert np.mean(np.square(once)) == pytest.approx(expected, rel=0.5)
    rare = left_open(simulator, fit, none, likelihood, 0.01, 0)
    assert np.mean(once) < rare < 5 * np.mean(once)
    assert left_open(simulator, fit, wide, likelihood, 0.01, 0) > 1.2 * rare

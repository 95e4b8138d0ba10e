"""How sure a fit is: by what the episodes disagree on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from compass_ros.calibration.cost import start
from compass_ros.calibration.least_squares import Fit, minimise, normal_equations
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.residuals import jackknife
from compass_ros.types import Floats
from test.calibration.toys import likelihood, linear

TRUTH = (0.7, -0.4)
FREE = np.arange(2)
PLAIN = 1e4
"""A robust scale that leaves everything quadratic."""


def fitted(given: Likelihood) -> Fit:
    return minimise(given, start(given, np.zeros(2)), FREE, 20, PLAIN, tolerance=1e-12)


def curved(_: Floats, inputs: Floats, time_s: Floats) -> Floats:
    """Nature where the model is a straight line in the input: it grows less than in proportion."""
    return np.asarray(np.tanh(inputs[:, None, :1]) * (0.7 - 0.4 * time_s[:, :, None]))


def recorded(inputs: Floats, seed: int) -> Likelihood:
    """What `curved` does with 1 % noise, to be fitted with `linear`."""
    time = np.tile(np.linspace(0, 1, 40), (len(inputs), 1))
    clean = curved(np.empty(0), inputs, time)
    noisy = clean + np.random.default_rng(seed).normal(0, 0.01, clean.shape)
    return replace(likelihood(linear, TRUTH, inputs), measured=noisy)


def test_to_leave_out_an_episode_is_to_fit_the_others() -> None:
    inputs = np.array([[1.0], [0.5], [-0.8], [1.4], [0.3]])
    given = likelihood(linear, TRUTH, inputs, noise=0.02, launch_std=0.05, launched=inputs * 1.03)
    fit = fitted(given)
    everything = np.arange(len(inputs))
    refits = np.array([fitted(given.of(np.delete(everything, e))).point.values for e in everything])
    away = refits - refits.mean(axis=0)
    expected = 4 / 5 * away.T @ away
    np.testing.assert_allclose(jackknife(given, fit), expected, rtol=0.05, atol=0.01 * np.abs(expected).max())


def test_a_formula_that_is_not_the_true_one_is_not_as_sure_as_the_noise_lets_it_seem() -> None:
    rng = np.random.default_rng(0)
    worlds = [recorded(rng.uniform(0.3, 2.0, (12, 1)), seed) for seed in range(60)]
    fits = [fitted(world) for world in worlds]
    spread = np.std([fit.point.values for fit in fits], axis=0)
    said = [np.sqrt(np.diag(jackknife(w, f))) for w, f in zip(worlds, fits, strict=True)]
    np.testing.assert_allclose(np.median(said, axis=0), spread, rtol=0.25)
    hessians = [
        normal_equations(w, f.point, f.linear, f.free, f.robust)[0][:2, :2] for w, f in zip(worlds, fits, strict=True)
    ]
    of_noise = [np.sqrt(np.diag(np.linalg.inv(hessian))) for hessian in hessians]
    assert (np.median(of_noise, axis=0) < 0.5 * spread).all()

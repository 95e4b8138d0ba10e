"""Likelihoods with known answers: a made predictor, parameters with bounds, and recordings of it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from compass_ros.calibration.likelihood import Likelihood, Predict
from compass_ros.types import Floats, Parameter


def likelihood(
    predict: Predict,
    truth: Sequence[float],
    inputs: Floats,
    *,
    sigma: float = 0.01,
    noise: float = 0.0,
    half_width: float = 1.0,
    bounds: tuple[float, float] = (-10.0, 10.0),
    launch_std: float = 0.0,
    launched: Floats | None = None,
    seconds: float = 1.0,
    frames: int = 40,
    seed: int = 0,
) -> Likelihood:
    """(E, A) inputs recorded with the truth; `launched`: what the inputs really were; prior mean zero."""
    episodes, p = len(inputs), len(truth)
    time = np.tile(np.linspace(0, seconds, frames), (episodes, 1))
    clean = predict(np.tile(truth, (episodes, 1)), inputs if launched is None else launched, time)
    measured = clean + np.random.default_rng(seed).normal(0, 1, clean.shape) * noise
    return Likelihood(
        predict=predict,
        parameters=tuple(Parameter(f"toy@dyna@p{i}", 0.0, *bounds, "1", half_width) for i in range(p)),
        inputs=inputs,
        time_s=time,
        measured=measured,
        sigma=np.full(measured.shape, sigma),
        correlation_time=1.0,
        launch_std=np.full(inputs.shape[1], launch_std),
        prior_mean=np.zeros(p),
        prior_std=np.full(p, half_width),
    )


def linear(values: Floats, inputs: Floats, time_s: Floats) -> Floats:
    """(B, F, 1): p0 + p1 t + p2 t^2, all times the input."""
    powers = time_s[:, :, None] ** np.arange(values.shape[1])
    return np.asarray(np.einsum("bfp,bp->bf", powers, values)[:, :, None] * inputs[:, None, :1])


def oscillation(values: Floats, inputs: Floats, time_s: Floats) -> Floats:
    """(B, F, 1): a sine whose phase grows with p0: many minima on a long horizon, one on a short one."""
    return np.asarray(np.sin((6.0 + values[:, :1]) * inputs[:, :1] * time_s)[:, :, None])

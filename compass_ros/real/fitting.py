"""Named parameters fitted to recordings with the least squares of the calibration, first states left free or not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from compass_ros.calibration.least_squares import Point, minimise, normal_equations
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.noise import correlation_time, neighbour_correlation
from compass_ros.simulation import Simulator
from compass_ros.simulation.replay import Recordings, recordings
from compass_ros.types import Episode, Floats

ROBUST = 1e3
"""Scale of the loss [sigma]: these recordings have no outliers, squares are meant."""


@dataclass(frozen=True)
class Unknown:
    """A parameter (or quantity of an effect) that a fit moves."""

    name: str
    start: float
    width: float
    """Standard deviation of what is known before, around `start`; also the scale of the first steps."""


@dataclass(frozen=True)
class Fitted:
    """A simulator whose parameters agree with recordings."""

    simulator: Simulator
    values: Floats
    """(P,)"""
    std: Mapping[str, float]
    """One standard deviation of each unknown, from the residual itself, its correlation in time counted."""
    launch: Floats
    """(E, A) what was added to each first state."""
    residual: Floats
    """(E, F, C) predicted less measured [m or rad]; NaN where nothing was measured."""
    rms: Floats
    """(E,) of each recording, over the columns in which anything was measured [m or rad]."""
    square: float
    """Mean square of the residual of all recordings."""
    effective: float
    """Independent numbers that were measured, the correlation of the residual counted."""
    prior: float
    """What the unknowns' distance from their starts costs [log likelihood]."""

    def value(self, name: str) -> float:
        return float(self.values[position(self.simulator, name)])


def position(simulator: Simulator, name: str) -> int:
    """Place of a parameter among the simulator's values. Raises ValueError."""
    return [p.name for p in simulator.parameters].index(name)


def likelihood_of(simulator: Simulator, data: Recordings, unknowns: Sequence[Unknown], free_start: bool) -> Likelihood:
    """Recordings as a likelihood with the cell's own noise. `free_start`: first states move as the cell's YAML says."""
    mean = simulator.defaults
    std = np.array([p.half_width for p in simulator.parameters])
    for unknown in unknowns:
        at = position(simulator, unknown.name)
        mean[at], std[at] = unknown.start, unknown.width
    launch = simulator.cell.launch_std
    return Likelihood(
        predict=simulator.observe,
        predict_alike=simulator.observe_alike,
        parameters=simulator.parameters,
        inputs=data.inputs,
        time_s=data.time_s,
        measured=data.measured,
        sigma=np.full(data.measured.shape, simulator.cell.spec.noise_m),
        correlation_time=1.0,
        launch_std=launch if free_start else np.zeros_like(launch),
        prior_mean=mean,
        prior_std=std,
    )


def fit(
    simulator: Simulator,
    episodes: Sequence[Episode],
    unknowns: Sequence[Unknown],
    free_start: bool = True,
    fixed: Mapping[str, float] | None = None,
    iterations: int = 25,
) -> Fitted:
    """Maximum a posteriori of the unknowns; everything else keeps its default, or what `fixed` says."""
    likelihood = likelihood_of(simulator, recordings(simulator.cell, episodes), unknowns, free_start)
    values = likelihood.prior_mean.copy()
    for name, value in (fixed or {}).items():
        values[position(simulator, name)] = value
    free = np.array([position(simulator, u.name) for u in unknowns], int)
    point = Point(values, np.zeros_like(likelihood.inputs), np.inf)
    found = minimise(likelihood, point, free, iterations, ROBUST, tolerance=0.05)
    residual = found.linear.residual * likelihood.sigma
    seen = ~np.isnan(likelihood.measured) & (np.ptp(np.nan_to_num(likelihood.measured), axis=(0, 1)) > 0)
    square = float(np.mean(residual[seen] ** 2))
    worth = correlation_time(neighbour_correlation(residual, seen))
    scale = square / simulator.cell.spec.noise_m**2 * worth
    hessian, _ = normal_equations(likelihood, found.point, found.linear, free, ROBUST)
    data_part = hessian - np.eye(len(hessian))
    covariance = np.linalg.inv(data_part / scale + np.eye(len(hessian)))
    std = np.sqrt(np.diag(covariance)[: len(free)]) * likelihood.prior_std[free]
    effective = float(np.sum(seen)) / worth
    return Fitted(
        simulator,
        found.point.values,
        dict(zip((u.name for u in unknowns), std.tolist(), strict=True)),
        found.point.launch,
        np.where(np.isnan(likelihood.measured), np.nan, residual),
        np.array([np.sqrt(np.mean(r[s] ** 2)) for r, s in zip(residual, seen, strict=True)]),
        square,
        effective,
        0.5 * float(np.sum(((found.point.values - likelihood.prior_mean)[free] / likelihood.prior_std[free]) ** 2)),
    )


def gain(better: Fitted, reference: Fitted, penalty: Sequence[str] = ()) -> float:
    """Log evidence of one fit over another of the same recordings, after Schwarz (BIC).

    The noise is as large as the residual; numbers that the better fit leaves correlated count as one. Unknowns named in
    `penalty` have a real prior, whose cost is counted instead of Schwarz's.
    """
    fall = 0.5 * better.effective * float(np.log(reference.square / better.square))

    def price(fitted: Fitted) -> float:
        free = [name for name in fitted.std if name not in penalty]
        return 0.5 * len(free) * float(np.log(better.effective)) + (fitted.prior if penalty else 0.0)

    return fall - price(better) + price(reference)


def residual_at(simulator: Simulator, values: Floats, episodes: Sequence[Episode]) -> Floats:
    """(E, F, C) what is simulated from the first states as they are, less what was measured; NaN where nothing was."""
    data = recordings(simulator.cell, episodes)
    predicted = simulator.observe(np.tile(values, (len(episodes), 1)), data.inputs, data.time_s)
    return np.asarray(predicted - data.measured)


def with_free_start(simulator: Simulator, values: Floats, episodes: Sequence[Episode]) -> Fitted:
    """The first state of each recording fitted to it, and nothing else."""
    fixed = dict(zip((p.name for p in simulator.parameters), values.tolist(), strict=True))
    return fit(simulator, episodes, (), True, fixed)


def thinned(episode: Episode, every: int) -> Episode:
    """Every n-th frame of each track."""
    tracks = tuple(replace(t, stamp_ns=t.stamp_ns[::every], value=t.value[::every], std=None) for t in episode.tracks)
    return replace(episode, tracks=tracks)

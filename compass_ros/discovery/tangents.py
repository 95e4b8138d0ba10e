"""Tangents of candidates that are no force along the way: contacts, commands, sensors. One rollout batch for each."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from compass_ros.calibration.least_squares import Fit
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.discovery.candidates import Candidate
from compass_ros.discovery.impulses import impulses
from compass_ros.discovery.screen import Score, Space, score_force, solve
from compass_ros.simulation import Simulator
from compass_ros.types import Floats


def screen(
    simulator: Simulator, likelihood: Likelihood, fit: Fit, asked: Sequence[Candidate]
) -> tuple[Space, list[Score]]:
    """All candidates to first order at a fit, the most promising first."""
    space = Space(simulator, likelihood, fit, impulses(simulator, likelihood, fit))
    return space, sorted((score(space, candidate) for candidate in asked), key=lambda s: -s.gain)


def score(space: Space, candidate: Candidate) -> Score:
    """A candidate at its best first-order amplitudes (and shapes)."""
    return score_force(space, candidate) if candidate.by_force else _score_rolled_out(space, candidate)


def _score_rolled_out(space: Space, candidate: Candidate) -> Score:
    quantities = candidate.attached.effect.quantities
    columns = differences(space, candidate)
    scale = np.array([q.scale for q in quantities])
    low, high = (np.array([getattr(q, side) for q in quantities]) for side in ("low", "high"))
    numbers, gain = solve(*space.reduced_tangent(columns), low, high, 20.0 * scale)
    return Score(candidate, numbers, gain, columns @ numbers)


def differences(space: Space, candidate: Candidate) -> Floats:
    """(D, q) change of the weighted residual per unit of each quantity, from a step of its scale."""
    quantities = candidate.attached.effect.quantities
    point, likelihood = space.fit.point, space.likelihood
    with_it = space.simulator.with_effects([*space.simulator.effects, candidate.attached])
    known, episodes = len(point.values), len(likelihood.inputs)
    values = np.zeros((len(quantities), known + len(quantities)))
    values[:, :known] = point.values
    values[:, known:] = np.diag([q.scale for q in quantities])
    inputs = np.tile(likelihood.inputs + point.launch, (len(quantities), 1))
    index = np.tile(np.arange(episodes), len(quantities))
    predicted = with_it.observe(np.repeat(values, episodes, axis=0), inputs, likelihood.time_s[index])
    there = np.nan_to_num((predicted - likelihood.measured[index]) / likelihood.sigma[index])
    change = there.reshape(len(quantities), episodes, -1) - space.fit.linear.residual.reshape(episodes, -1)
    scale = np.array([q.scale for q in quantities])
    return np.asarray((change * space.weight).reshape(len(quantities), -1).T / scale)

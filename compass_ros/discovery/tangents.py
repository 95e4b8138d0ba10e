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

FELT = 5.0
"""Movement of all recordings together [sigma] from which a step says what an effect does."""
IN_PROPORTION = 3.0
"""Growth of what a step does when it is doubled, up to which the effect counts as proportional to its size."""
STRETCH, LONGER = 4.0, 2
"""By how much a step is lengthened that is not felt, and how often."""


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
    """The best of steps that are doubled until they do twice as much: limits do nothing, then a lot."""
    quantities = candidate.attached.effect.quantities
    amplitude = np.array([q.amplitude for q in quantities])
    low, high, scale = (np.array([getattr(q, what) for q in quantities]) for what in ("low", "high", "scale"))
    low, high, scale = low[amplitude], high[amplitude], scale[amplitude]
    found: list[Score] = []
    steps, before = scale, 0.0
    while np.all(steps <= high):
        change = changes(space, candidate, _alone(candidate, steps))
        columns = change / steps
        amounts, gain = solve(*space.reduced_tangent(columns), low, high, 20.0 * scale)
        numbers = np.array([q.start for q in quantities])
        numbers[amplitude] = amounts
        found.append(Score(candidate, numbers, gain, columns @ amounts))
        done = float(np.linalg.norm(change))
        if FELT < done < IN_PROPORTION * before:
            break
        steps, before = 2.0 * steps, done
    return max(found, key=lambda s: s.gain)


def differences(space: Space, candidate: Candidate) -> Floats:
    """(D, a) change of the weighted residual per unit of each amplitude, from a step of its scale.

    The step is longer where that is not felt: a limit or a dead band does nothing until it is reached.
    """
    quantities = [q for q in candidate.attached.effect.quantities if q.amplitude]
    steps = np.array([q.scale for q in quantities])
    change = changes(space, candidate, _alone(candidate, steps))
    for _ in range(LONGER):
        unfelt = (np.linalg.norm(change, axis=0) < FELT) & (steps * STRETCH < [q.high for q in quantities])
        if not unfelt.any():
            break
        steps = np.where(unfelt, STRETCH * steps, steps)
        change[:, unfelt] = changes(space, candidate, _alone(candidate, steps)[unfelt])
    return np.asarray(change / steps)


def _alone(candidate: Candidate, steps: Floats) -> Floats:
    """(a, q) settings: each of the amplitudes alone at its step, shapes as they begin."""
    quantities = candidate.attached.effect.quantities
    settings = np.tile([q.start for q in quantities], (len(steps), 1))
    settings[:, [q.amplitude for q in quantities]] = np.diag(steps)
    return settings


def changes(space: Space, candidate: Candidate, numbers: Floats) -> Floats:
    """(D, n) change of the weighted residual by each of (n, q) settings of an effect."""
    point, likelihood = space.fit.point, space.likelihood
    with_it = space.simulator.with_effects([*space.simulator.effects, candidate.attached])
    episodes = len(likelihood.inputs)
    values = np.concatenate([np.tile(point.values, (len(numbers), 1)), numbers], axis=1)
    inputs = np.tile(likelihood.inputs + point.launch, (len(numbers), 1))
    index = np.tile(np.arange(episodes), len(numbers))
    predicted = with_it.observe(np.repeat(values, episodes, axis=0), inputs, likelihood.time_s[index])
    there = np.nan_to_num(likelihood.difference(predicted, likelihood.measured[index]) / likelihood.sigma[index])
    change = there.reshape(len(numbers), episodes, -1) - space.fit.linear.residual.reshape(episodes, -1)
    return np.asarray((change * space.weight).reshape(len(numbers), -1).T)

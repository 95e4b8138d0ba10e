"""The model linearised at a point: finite differences, taken in one batch of rollouts, and kept up by secants."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from compass_ros.calibration.cost import Point
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.types import Bools, Floats, Ints

FIRST_STEP = 0.02
"""First finite differences, in standard deviations of the prior."""
LAUNCH_STEP, FARTHER = 0.1, 1.0
"""Differences of launches, in their standard deviations: the first, and where that shows the simulator's roughness. A
box on a slope (`test_sliding_box.py`), begun at the wrong friction: the fit leaves a chi-square of 4.2 with a tenth for
all, 3.2 with three tenths, 0.8 with one, and 0.8 with a tenth for speeds along the slope and one for the rest."""
DOUBTFUL = 2 * 2**0.5
"""Difference of two observations, in their roughness, up to which it may be nothing else: two standard deviations."""
MARGIN_S = 0.1
"""How much earlier than at a point nearby a parameter may begin to act [s]."""


@dataclass(frozen=True)
class Linear:
    """The model linearised at a point. n = free parameters + launches."""

    residual: Floats
    """(E, F, C) in sigma."""
    jacobian: Floats
    """(E, F, C, p) change of the residual per prior standard deviation of each free parameter."""
    launch_jacobian: Floats
    """(E, F, C, l) change of the episode's own residual per standard deviation of its launch."""
    onset: Floats
    """(E, p) simulated time up to which a parameter did nothing in an episode [s], there where differences were taken;
    what the simulator need not repeat when they are taken anew nearby."""

    def of(self, episodes: Ints) -> Linear:
        """The same of some episodes."""
        parts = (self.residual, self.jacobian, self.launch_jacobian, self.onset)
        return Linear(*(part[episodes] for part in parts))

    def only(self, free: Ints | Bools) -> Linear:
        """The same of some of the free parameters."""
        return replace(self, jacobian=self.jacobian[..., free], onset=self.onset[:, free])


def inward(likelihood: Likelihood, point: Point, which: Ints, steps: Floats) -> Floats:
    """(p,) changes of some parameters in their units, from steps in standard deviations of the prior.

    A step that would leave the bounds is taken to the other side; where both sides end too soon, to the farther bound.
    """
    value, low, high = point.values[which], likelihood.low[which], likelihood.high[which]
    ahead = steps * likelihood.prior_std[which]
    fits, fits_back = ((value + step >= low) & (value + step <= high) for step in (ahead, -ahead))
    farther = np.where(high - value >= value - low, high, low) - value
    return np.where(fits, ahead, np.where(fits_back, -ahead, farther))


def linearise(likelihood: Likelihood, point: Point, free: Ints, steps: Floats, onset: Floats | None = None) -> Linear:
    """Residual and one-sided differences at a point; (p,) steps in standard deviations of the prior, as in `inward`.

    `onset`: as in `Linear`, at a point nearby.
    """
    episodes = len(likelihood.inputs)
    random = np.flatnonzero(likelihood.launch_std > 0)
    steps = inward(likelihood, point, free, steps)
    columns = 1 + len(free) + len(random)
    values = np.tile(point.values, (columns, episodes, 1))
    inputs = np.tile(likelihood.inputs + point.launch, (columns, 1, 1))
    for i, parameter in enumerate(free):
        values[1 + i, :, parameter] += steps[i]
    for i, column in enumerate(random):
        inputs[1 + len(free) + i, :, column] += LAUNCH_STEP * likelihood.launch_std[column]
    index = np.tile(np.arange(episodes), columns)
    until = np.zeros((columns, episodes))
    if onset is not None:
        until[1 : 1 + len(free)] = np.maximum(onset.T - MARGIN_S, 0.0)
    rows = len(index)
    flat, same = likelihood.residual_alike(
        values.reshape(rows, values.shape[2]), inputs.reshape(rows, inputs.shape[2]), index, index, until.ravel()
    )
    residual = flat.reshape(columns, episodes, *flat.shape[1:])
    scale = likelihood.prior_std[free] / steps
    jacobian = np.moveaxis((residual[1 : 1 + len(free)] - residual[0]) * scale[:, None, None, None], 0, -1)
    launch = np.moveaxis((residual[1 + len(free) :] - residual[0]) / LAUNCH_STEP, 0, -1)
    launch = _seen(likelihood, point, residual[0], launch)
    return Linear(residual[0], jacobian, launch, same.reshape(columns, episodes)[1 : 1 + len(free)].T)


def _seen(likelihood: Likelihood, point: Point, residual: Floats, launch: Floats) -> Floats:
    """(E, F, C, l) differences of launches, those that may be the simulator's roughness alone taken over a whole
    standard deviation.
    """
    if likelihood.rough is None or likelihood.smooth:
        return launch
    change = np.sqrt(np.mean((LAUNCH_STEP * launch) ** 2, axis=(1, 2)))  # (E, l)
    rough = np.sqrt(np.mean((likelihood.rough / likelihood.sigma) ** 2, axis=(1, 2)))
    episode, column = np.nonzero(change < DOUBTFUL * rough[:, None])
    if not len(episode):
        return launch
    inputs = likelihood.inputs[episode] + point.launch[episode]
    which = np.flatnonzero(likelihood.launch_std > 0)[column]
    inputs[np.arange(len(which)), which] += FARTHER * likelihood.launch_std[which]
    there = likelihood.residual(np.tile(point.values, (len(episode), 1)), inputs, episode)
    launch = launch.copy()
    launch[episode, :, :, column] = (there - residual[episode]) / FARTHER
    return launch


def extended(
    old: Linear, likelihood: Likelihood, point: Point, residual: Floats, free: Ints, steps: Floats | None = None
) -> Linear:
    """Differences that are known of the first of the `free` parameters, with those of the others taken at a point.

    `residual`: (E, F, C) there. `steps`: (p,) as in `linearise`, where they are known.
    """
    known, episodes = old.jacobian.shape[-1], len(likelihood.inputs)
    new = free[known:]
    steps = inward(likelihood, point, new, np.full(len(new), FIRST_STEP) if steps is None else steps[known:])
    values = np.tile(point.values, (len(new), 1))
    values[np.arange(len(new)), new] += steps
    index = np.tile(np.arange(episodes), len(new))
    inputs = np.tile(likelihood.inputs + point.launch, (len(new), 1))
    there = likelihood.residual(np.repeat(values, episodes, axis=0), inputs, index)
    change = there.reshape(len(new), *residual.shape) - residual
    scaled = np.moveaxis(change * (likelihood.prior_std[new] / steps)[:, None, None, None], 0, -1)
    onset = np.concatenate([old.onset, np.zeros((episodes, len(new)))], axis=1)
    return Linear(residual, np.concatenate([old.jacobian, scaled], axis=-1), old.launch_jacobian, onset)


def central(likelihood: Likelihood, point: Point, free: Ints, steps: Floats, onset: Floats | None = None) -> Linear:
    """The same with central differences: exact to second order, for twice the rollouts."""
    up = linearise(likelihood, point, free, steps, onset)
    down = linearise(likelihood, point, free, -steps, up.onset)
    jacobian = 0.5 * (up.jacobian + down.jacobian)
    return Linear(up.residual, jacobian, up.launch_jacobian, np.minimum(up.onset, down.onset))


def difference_steps(linear: Linear) -> Floats:
    """(p,) steps that move the residual by about one sigma: above the simulator's roughness, below its curvature.

    Judged by the upper quartile over episodes, since one episode with an unlucky collision would make all steps tiny.
    """
    effect = np.sqrt(np.mean(linear.jacobian**2, axis=(1, 2)))  # (E, p)
    typical = np.quantile(effect, 0.75, axis=0)
    return np.asarray(np.clip(1.0 / np.maximum(typical, 1e-12), 1e-3, 1.0))


def broyden(linear: Linear, residual: Floats, move: Floats) -> Linear:
    """The least change of the differences that predicts the step's residual (Broyden 1965, rank one per episode)."""
    episodes, p = len(residual), linear.jacobian.shape[-1]
    launches = move[p:].reshape(episodes, -1)
    predicted = linear.residual + linear.jacobian @ move[:p]
    predicted += np.einsum("efcl,el->efc", linear.launch_jacobian, launches)
    missed = residual - predicted
    length = np.sum(move[:p] ** 2) + np.sum(launches**2, axis=1)  # (E,)
    share = missed / np.maximum(length, 1e-300)[:, None, None]
    return replace(
        linear,
        residual=residual,
        jacobian=linear.jacobian + share[..., None] * move[:p],
        launch_jacobian=linear.launch_jacobian + share[..., None] * launches[:, None, None],
    )

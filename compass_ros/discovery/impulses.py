"""What a short push on each body at each moment would do to the recordings.

A force that acts along the way moves a trajectory as the sum of what its pushes do, one after the other, through all
later collisions. So a few rollouts with unit pushes at K moments give the tangent of every force field, of any shape,
without rolling it out: the field's accelerations along the calibrated paths are the weights. The pushes are hats in
time, so the weights interpolate linearly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from compass_ros.calibration.least_squares import Fit
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import Attached, Effect, Quantity
from compass_ros.simulation.effects.effect import Context
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.types import Floats

MOMENTS = 25
SPEED_CHANGE = 2e-3
"""Change of speed by one unit push [m/s]: a few millimetres at the end, above the simulator's roughness."""


def _forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
    return tuple(Term(Kind.HAT, name, numbers) for name in context.objects)


_PUSH = Effect(
    name="push",
    channel="dynamics",
    quantities=(
        Quantity("acceleration_x", "m/s^2", -1.0, 1.0, 0.01),
        Quantity("acceleration_y", "m/s^2", -1.0, 1.0, 0.01),
        Quantity("moment", "s", 0.0, 1e6, 1.0, amplitude=False),
        Quantity("half_width", "s", 1e-3, 1e6, 1.0, amplitude=False, start=1.0),
    ),
    sentence="a push",
    forces=_forces,
)


@dataclass(frozen=True)
class Impulses:
    """Responses to unit pushes. E episodes, D residuals of one episode, K moments, N movers, 2 directions."""

    movers: tuple[str, ...]
    moments: Floats
    """(K,) [s] since the command."""
    paths: Floats
    """(E, K, N, 4) x, y, vx, vy of the movers at these moments."""
    mass: Floats
    """(N,)"""
    response: Floats
    """(E, D, K * N * 2) change of the residual [sigma] per m/s^2."""


def impulses(simulator: Simulator, likelihood: Likelihood, fit: Fit) -> Impulses:
    """Roll out unit pushes around a fit of a simulator, with the effects that it has."""
    movers = simulator.movers()
    episodes, duration = len(likelihood.inputs), float(likelihood.time_s.max())
    half = duration / MOMENTS
    moments = half * (np.arange(MOMENTS) + 0.5)
    pushed = simulator.with_effects([*simulator.effects, *(Attached(_PUSH, (name,)) for name in movers)])
    known = len(fit.point.values)
    cases = [(k, n, a) for k in range(MOMENTS) for n in range(len(movers)) for a in range(2)]
    none = np.concatenate([fit.point.values, np.tile([0.0, 0.0, 0.0, half], len(movers))])
    values = np.tile(none, (1 + len(cases), 1))
    until = np.zeros(1 + len(cases))
    size = SPEED_CHANGE / half
    for i, (k, n, a) in enumerate(cases, 1):
        values[i, known + 4 * n + a] = size
        values[i, known + 4 * n + 2] = moments[k]
        until[i] = max(moments[k] - half, 0.0)
    inputs = likelihood.inputs + fit.point.launch
    index = np.tile(np.arange(episodes), len(values))
    predicted, _ = pushed.observe_alike(
        np.repeat(values, episodes, axis=0), inputs[index], likelihood.time_s[index], index, np.repeat(until, episodes)
    )
    there = np.nan_to_num(likelihood.difference(predicted, likelihood.measured[index]) / likelihood.sigma[index])
    there = there.reshape(len(values), episodes, -1)
    change = (there[1:] - there[0]) / size
    base = np.tile(fit.point.values, (episodes, 1))
    paths = simulator.paths(base, inputs, moments, movers)
    return Impulses(movers, moments, paths, simulator.masses(fit.point.values, movers), np.moveaxis(change, 0, -1))

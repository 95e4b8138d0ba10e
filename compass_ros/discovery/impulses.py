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
from compass_ros.simulation.sites import JOINTS, PLANAR
from compass_ros.simulation.visited import Visited
from compass_ros.types import Bools, Floats

MOMENTS = 25
SPEED_CHANGE, OF_SPEED = 2e-3, 4e-3
"""Change of speed by one unit push: of bodies in the plane [m/s], a few millimetres at the end and above the
simulator's roughness; of joints as a share of their own speed, what the former is to a puck's 0.5 m/s."""
OF_LENGTH, OF_PUSH = 5.0, 2.0
"""Unit of length and of acceleration of a joint, in the spread of its position and in speed^2 / spread: a body in the
plane has 1 m and 1 m/s^2, and pucks at 0.3 m/s that spread over 0.2 m come to the same."""


def _forces(numbers: Floats, context: Context) -> tuple[Term, ...]:
    return tuple(Term(Kind.HAT, site, numbers) for site in context.sites)


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
    on=(*PLANAR, *JOINTS),
    forces=_forces,
)


@dataclass(frozen=True)
class Impulses:
    """Responses to unit pushes. E episodes, D residuals of one episode, K moments, N movers, 2 directions."""

    movers: tuple[str, ...]
    joints: Bools
    """(N,) which of them are joints: they have one direction, the first, and what is said of bodies holds of angles."""
    moments: Floats
    """(K,) [s] since the command."""
    paths: Floats
    """(E, K, N, 4) x, y, vx, vy of the movers at these moments."""
    mass: Floats
    """(N,) [kg]; of a joint its own inertia."""
    length: Floats
    """(N,) unit of length [m, rad]."""
    push: Floats
    """(N,) unit of acceleration [m/s^2, rad/s^2]."""
    response: Floats
    """(E, D, K * N * 2) change of the residual [sigma] per m/s^2."""


def impulses(simulator: Simulator, likelihood: Likelihood, fit: Fit) -> Impulses:
    """Roll out unit pushes around a fit of a simulator, with the effects that it has."""
    movers, sites = simulator.movers(), list(simulator.moving.values())
    episodes, duration = len(likelihood.inputs), float(likelihood.time_s.max())
    half = duration / MOMENTS
    moments = half * (np.arange(MOMENTS) + 0.5)
    attached = [Attached(_PUSH.on_kinds((site.kind,)), site.names) for site in sites]
    pushed = simulator.with_effects([*simulator.effects, *attached])
    inputs = likelihood.inputs + fit.point.launch
    of_movers = _size(simulator, likelihood, fit)
    sizes = [of_movers[name] for name in movers]
    joints = np.array([site.kind in JOINTS for site in sites], bool)
    known = len(fit.point.values)
    cases = [(k, n, a) for k in range(MOMENTS) for n in range(len(movers)) for a in range(1 if joints[n] else 2)]
    none = np.concatenate([fit.point.values, np.tile([0.0, 0.0, 0.0, half], len(movers))])
    values = np.tile(none, (1 + len(cases), 1))
    until, given = np.zeros(1 + len(cases)), np.ones(len(cases))
    for i, (k, n, a) in enumerate(cases, 1):
        given[i - 1] = sizes[n].change / half
        values[i, known + 4 * n + a] = given[i - 1] * (sizes[n].mass if joints[n] else 1.0)
        values[i, known + 4 * n + 2] = moments[k]
        until[i] = max(moments[k] - half, 0.0)
    index = np.tile(np.arange(episodes), len(values))
    predicted, _ = pushed.observe_alike(
        np.repeat(values, episodes, axis=0), inputs[index], likelihood.time_s[index], index, np.repeat(until, episodes)
    )
    there = np.nan_to_num(likelihood.difference(predicted, likelihood.measured[index]) / likelihood.sigma[index])
    there = there.reshape(len(values), episodes, -1)
    change = np.zeros((MOMENTS * len(movers) * 2, episodes, there.shape[2]))
    change[[(k * len(movers) + n) * 2 + a for k, n, a in cases]] = (there[1:] - there[0]) / given[:, None, None]
    paths = simulator.paths(np.tile(fit.point.values, (episodes, 1)), inputs, moments, movers)
    mass, length, push = np.array([(s.mass, s.length, s.push) for s in sizes]).reshape(-1, 3).T
    return Impulses(movers, joints, moments, paths, mass, length, push, np.moveaxis(change, 0, -1))


@dataclass(frozen=True)
class _Size:
    """Of one mover, as `Impulses` has it, and the change of speed by a unit push."""

    mass: float
    length: float
    push: float
    change: float


def _size(simulator: Simulator, likelihood: Likelihood, fit: Fit) -> dict[str, _Size]:
    values, inputs = fit.point.values, likelihood.inputs + fit.point.launch
    bodies = [name for name, site in simulator.moving.items() if site.kind not in JOINTS]
    masses = simulator.masses(values, bodies)
    out = {name: _Size(float(m), 1.0, 1.0, SPEED_CHANGE) for name, m in zip(bodies, masses, strict=True)}
    for name, s in Visited(simulator, values, inputs, likelihood.time_s).joint_sizes().items():
        push = OF_PUSH * s.speed**2 / s.spread
        out[name] = _Size(s.inertia, OF_LENGTH * s.spread, push, OF_SPEED * s.speed)
    return out

"""Maximum a posteriori by Levenberg-Marquardt, with finite differences taken in one batch of rollouts.

Source: Nocedal and Wright 2006, chapter 10; robust weights after Huber in the smooth form of Charbonnier,
rho(r) = 2 c^2 (sqrt(1 + r^2 / c^2) - 1), by iteratively reweighted least squares.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from compass_ros.calibration.likelihood import Likelihood
from compass_ros.types import Bools, Floats, Ints

FIRST_STEP = 0.02
"""First finite differences, in standard deviations of the prior."""
MARGIN_S = 0.1
"""How much earlier than at a point nearby a parameter may begin to act [s]."""
_TRIALS = ((1.0,), (0.01, 100.0))
"""Damping factors, relative to the current one: those of a group are tried at once, the second group where the first
does not do what the linear model hopes for."""
_AS_HOPED, _EASIER = 0.9, 0.1
"""Share of the hoped fall of the cost from which a step is as good as any, and factor of the damping after such a one;
where the linear model holds, damping only shortens the step."""


@dataclass(frozen=True)
class Point:
    """Where a fit stands."""

    values: Floats
    """(P,) parameters."""
    launch: Floats
    """(E, A) offsets of the inputs."""
    cost: float
    """Half the robust sum of squares plus half the prior's; infinite before it was evaluated."""


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


@dataclass(frozen=True)
class Fit:
    """Result of `minimise`."""

    point: Point
    linear: Linear
    free: Ints
    """(p,) indices of the free parameters."""
    robust: float
    """Scale c of the robust loss [sigma]."""
    iterations: int
    converged: bool
    """The cost stopped falling; False: the iterations ran out."""


def start(likelihood: Likelihood, values: Floats) -> Point:
    """A point at the commanded launches."""
    return Point(values, np.zeros_like(likelihood.inputs), np.inf)


def cost(likelihood: Likelihood, points: list[Point], robust: float) -> tuple[Floats, Floats]:
    """(N,) cost and (N, E, F, C) residual of each point, all rolled out in one batch."""
    episodes = len(likelihood.inputs)
    values = np.repeat(np.stack([p.values for p in points]), episodes, axis=0)
    inputs = np.concatenate([likelihood.inputs + p.launch for p in points])
    flat = likelihood.residual(values, inputs, np.tile(np.arange(episodes), len(points)))
    residual = flat.reshape(len(points), episodes, *flat.shape[1:])
    of_point = robust_loss(residual, robust).reshape(len(points), -1).sum(axis=1)
    return np.array([0.5 * c + _prior(likelihood, p) for c, p in zip(of_point, points, strict=True)]), residual


def robust_loss(residual: Floats, robust: float) -> Floats:
    """rho of each residual: its square where it is small beside the scale, twice the scale times it where large."""
    squared = residual**2
    return np.asarray(2 * squared / (np.sqrt(1 + squared / robust**2) + 1))  # stable for large scales


def robust_weight(residual: Floats, robust: float) -> Floats:
    """Factor of each squared residual that gives the robust loss's gradient: 1 where small, falling where large."""
    return np.asarray(1 / np.sqrt(1 + (residual / robust) ** 2))


def _prior(likelihood: Likelihood, point: Point) -> float:
    scaled = (point.values - likelihood.prior_mean) / likelihood.prior_std
    random = likelihood.launch_std > 0
    launch = point.launch[:, random] / likelihood.launch_std[random]
    return 0.5 * float(np.sum(scaled**2) + np.sum(launch**2))


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
        inputs[1 + len(free) + i, :, column] += 0.1 * likelihood.launch_std[column]
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
    launch = np.moveaxis((residual[1 + len(free) :] - residual[0]) * 10.0, 0, -1)
    return Linear(residual[0], jacobian, launch, same.reshape(columns, episodes)[1 : 1 + len(free)].T)


def extended(old: Linear, likelihood: Likelihood, point: Point, residual: Floats, free: Ints) -> Linear:
    """Differences that are known of the first of the `free` parameters, with those of the others taken at a point.

    `residual`: (E, F, C) there.
    """
    new = free[old.jacobian.shape[-1] :]
    episodes = len(likelihood.inputs)
    steps = inward(likelihood, point, new, np.full(len(new), FIRST_STEP))
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


def moved(likelihood: Likelihood, point: Point, free: Ints, move: Floats) -> Point:
    """A point moved by (n,) standard deviations of the prior, inside the bounds."""
    p = len(free)
    values, launch = point.values.copy(), point.launch.copy()
    values[free] = np.clip(
        values[free] + likelihood.prior_std[free] * move[:p], likelihood.low[free], likelihood.high[free]
    )
    random = likelihood.launch_std > 0
    launch[:, random] += move[p:].reshape(len(launch), -1) * likelihood.launch_std[random]
    return Point(values, launch, np.inf)


def difference_steps(linear: Linear) -> Floats:
    """(p,) steps that move the residual by about one sigma: above the simulator's roughness, below its curvature.

    Judged by the upper quartile over episodes, since one episode with an unlucky collision would make all steps tiny.
    """
    effect = np.sqrt(np.mean(linear.jacobian**2, axis=(1, 2)))  # (E, p)
    typical = np.quantile(effect, 0.75, axis=0)
    return np.asarray(np.clip(1.0 / np.maximum(typical, 1e-12), 1e-3, 1.0))


def normal_equations(
    likelihood: Likelihood, point: Point, linear: Linear, free: Ints, robust: float
) -> tuple[Floats, Floats]:
    """(n, n) Gauss-Newton Hessian and (n,) gradient in units of the prior's standard deviations, prior included."""
    weight = robust_weight(linear.residual, robust)
    episodes, p, launches = len(likelihood.inputs), len(free), linear.launch_jacobian.shape[-1]
    n = p + episodes * launches
    hessian, gradient = np.eye(n), np.zeros(n)
    j = linear.jacobian.reshape(episodes, linear.residual[0].size, p)
    jl = linear.launch_jacobian.reshape(episodes, j.shape[1], launches)
    w, r = weight.reshape(episodes, -1), linear.residual.reshape(episodes, -1)
    for e in range(episodes):
        own = slice(p + e * launches, p + (e + 1) * launches)
        weighted = j[e] * w[e][:, None]
        hessian[:p, :p] += weighted.T @ j[e]
        hessian[:p, own] += weighted.T @ jl[e]
        hessian[own, :p] += jl[e].T @ weighted
        hessian[own, own] += (jl[e] * w[e][:, None]).T @ jl[e]
        gradient[:p] += weighted.T @ r[e]
        gradient[own] += (jl[e] * w[e][:, None]).T @ r[e]
    random = likelihood.launch_std > 0
    gradient[:p] += (point.values[free] - likelihood.prior_mean[free]) / likelihood.prior_std[free]
    gradient[p:] += (point.launch[:, random] / likelihood.launch_std[random]).ravel()
    return hessian, gradient


def minimise(
    likelihood: Likelihood,
    point: Point,
    free: Ints,
    iterations: int,
    robust: float = 4.0,
    tolerance: float = 1e-3,
    linear: Linear | None = None,
    fresh: bool = True,
    steps: Floats | None = None,
    onset: Floats | None = None,
) -> Fit:
    """Levenberg-Marquardt from a point until a step would lower the cost by less than `tolerance` (log likelihood).

    Differences are taken anew only where the model failed to predict what a step did; otherwise Broyden's update keeps
    it going, which costs no rollout. `linear`: differences that are known already near the point. `fresh`: end with
    differences at the solution, as standard errors need them. `steps`: (p,) of the first differences, where known.
    `onset`: (E, p) where it is known at a point nearby and `linear` is not.
    """
    damping = 1e-3
    steps = np.full(len(free), FIRST_STEP) if steps is None else steps
    costs, residuals = cost(likelihood, [point], robust)
    point, exact = replace(point, cost=float(costs[0])), False
    if linear is not None:
        linear, steps, onset = replace(linear, residual=residuals[0]), difference_steps(linear), linear.onset
    iteration, converged = 0, False
    while iteration < iterations and not converged:
        iteration += 1
        if linear is None:
            linear, steps = _linearise_well(likelihood, point, free, steps, onset)
            onset, exact = linear.onset, True
        step = _best_step(likelihood, point, linear, free, robust, damping)
        gained = point.cost - step.point.cost
        if gained > 0:
            damping, point = step.damping, step.point
            converged = exact and gained < tolerance
            keep = converged or (gained > 0.5 * step.hoped and gained > tolerance)
            linear = broyden(linear, step.residual, step.move) if keep else None
            exact = False
        elif exact:
            damping *= 1e3
            converged = damping > 1e6
        else:
            linear = None  # the updated differences were wrong: take them anew
    if linear is None or (fresh and not exact):
        linear, _ = _linearise_well(likelihood, point, free, steps, onset)
    return Fit(point, linear, free, robust, iteration, converged)


@dataclass(frozen=True)
class _Step:
    """A damped step that was tried."""

    point: Point
    residual: Floats
    """(E, F, C) there."""
    move: Floats
    """(n,) standard deviations of the prior."""
    hoped: float
    """Fall of the cost by the linear model."""
    damping: float
    """To begin the next step with."""


def _best_step(
    likelihood: Likelihood, point: Point, linear: Linear, free: Ints, robust: float, damping: float
) -> _Step:
    """The step with this damping where it does what the linear model hopes for; else the best with others too."""
    hessian, gradient = normal_equations(likelihood, point, linear, free, robust)
    found: list[_Step] = []
    for factors in _TRIALS:
        dampings = [damping * factor for factor in factors]
        trials = [damped_step(likelihood, point, free, hessian, gradient, d) for d in dampings]
        for trial, c, residual, d in zip(trials, *cost(likelihood, trials, robust), dampings, strict=True):
            move = move_between(likelihood, point, trial, free)
            hoped = -float(gradient @ move + 0.5 * move @ hessian @ move)
            found.append(_Step(replace(trial, cost=float(c)), residual, move, hoped, max(d, 1e-9)))
        if len(found) == 1 and point.cost - found[0].point.cost > _AS_HOPED * found[0].hoped:
            return replace(found[0], damping=max(_EASIER * damping, 1e-9))
    return min(found, key=lambda step: step.point.cost)


def _linearise_well(
    likelihood: Likelihood, point: Point, free: Ints, steps: Floats, onset: Floats | None
) -> tuple[Linear, Floats]:
    """Differences, taken once more where the steps were far too long; and the steps for the next time."""
    linear = linearise(likelihood, point, free, steps, onset)
    better = difference_steps(linear)
    if np.any(better < 0.25 * steps):
        linear = linearise(likelihood, point, free, np.minimum(steps, better), linear.onset)
        better = difference_steps(linear)
    return linear, better


def move_between(likelihood: Likelihood, old: Point, new: Point, free: Ints) -> Floats:
    """(n,) step from one point to another in standard deviations of the prior."""
    random = likelihood.launch_std > 0
    values = (new.values - old.values)[free] / likelihood.prior_std[free]
    launch = (new.launch - old.launch)[:, random] / likelihood.launch_std[random]
    return np.concatenate([values, launch.ravel()])


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


def damped_step(
    likelihood: Likelihood, point: Point, free: Ints, hessian: Floats, gradient: Floats, damping: float
) -> Point:
    """A step with the Hessian's diagonal raised by a share.

    It is kept inside the bounds: what would leave them stays on them and the rest is solved again.
    """
    p = len(free)
    scale = likelihood.prior_std[free]
    low = (likelihood.low[free] - point.values[free]) / scale
    high = (likelihood.high[free] - point.values[free]) / scale
    move = np.zeros(len(gradient))
    held: Bools = np.zeros(len(gradient), bool)
    damped = hessian + damping * np.diag(np.diag(hessian))
    for _ in range(4):
        loose = ~held
        move[loose] = -np.linalg.solve(
            damped[np.ix_(loose, loose)], gradient[loose] + damped[np.ix_(loose, held)] @ move[held]
        )
        outside = np.flatnonzero((move[:p] < low) | (move[:p] > high))
        if not len(outside):
            break
        move[outside] = np.clip(move[outside], low[outside], high[outside])
        held[outside] = True
    move[:p] = np.clip(move[:p], low, high)
    return moved(likelihood, point, free, move)

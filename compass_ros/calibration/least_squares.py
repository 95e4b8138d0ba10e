"""Maximum a posteriori by Levenberg-Marquardt, with finite differences taken in one batch of rollouts.

Source: Nocedal and Wright 2006, chapter 10.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from compass_ros.calibration.cost import Point, cost, launches_away, robust_weight
from compass_ros.calibration.differences import FIRST_STEP, Linear, broyden, difference_steps, linearise
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.types import Bools, Floats, Ints

_OTHERS = (0.01, 100.0)
"""Damping factors, relative to the current one, that are tried where that one does not do what it should."""
_AS_HOPED, _EASIER = 0.9, 0.1
"""Share of the hoped fall of the cost from which a step is as good as any, and factor of the damping after such a one;
where the linear model holds, damping only shortens the step."""
LONGER = (2.0, 4.0, 8.0, 16.0)
"""Factors by which a step is stretched that gained more than was hoped for: a budget. A seven-joint arm's last six sets
of differences end at 15,046.6 with them, and at 15,048.3, still falling by 7 a set, without."""


NONE: Ints = np.zeros(0, dtype=np.int64)
"""No parameters."""


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
    gradient[:p] += (point.values[free] - likelihood.prior_mean[free]) / likelihood.prior_std[free]
    gradient[p:] += launches_away(likelihood, point).ravel()
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
    differences that were taken at the solution, or a step below `tolerance` before it, as standard errors need them.
    `steps`: (p,) of the first differences, where known.
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
        normal = normal_equations(likelihood, point, linear, free, robust)
        (step,) = tried(likelihood, point, free, normal, robust, [damping])
        as_hoped = point.cost - step.point.cost > _AS_HOPED * step.hoped
        if not as_hoped:
            others = [damping * factor for factor in _OTHERS]
            step = lowest([step, *tried(likelihood, point, free, normal, robust, others)])
        gained = point.cost - step.point.cost
        if gained > 0:
            damping = max(step.damping * (_EASIER if as_hoped else 1.0), 1e-9)
            point = step.point
            converged = exact and gained < tolerance
            keep = converged or (gained > 0.5 * step.hoped and gained > tolerance)
            linear = broyden(linear, step.residual, step.move) if keep else None
            exact = converged
        elif exact:
            damping *= 1e3
            converged = damping > 1e6
        else:
            linear = None  # the updated differences were wrong: take them anew
    if linear is None or (fresh and not exact):
        linear, _ = _linearise_well(likelihood, point, free, steps, onset)
    return Fit(point, linear, free, robust, iteration, converged)


@dataclass(frozen=True)
class Step:
    """A damped step that was tried."""

    point: Point
    residual: Floats
    """(E, F, C) there."""
    move: Floats
    """(n,) standard deviations of the prior."""
    hoped: float
    """Fall of the cost by the linear model."""
    damping: float


def tried(
    likelihood: Likelihood,
    point: Point,
    free: Ints,
    normal: tuple[Floats, Floats],
    robust: float,
    dampings: Sequence[float],
) -> list[Step]:
    """A step with each damping, all rolled out in one batch; `normal` equations at the point."""
    trials = [damped_step(likelihood, point, free, *normal, damping) for damping in dampings]
    return _judged(likelihood, point, free, normal, robust, trials, dampings)


def stretched(
    likelihood: Likelihood, point: Point, free: Ints, normal: tuple[Floats, Floats], robust: float, step: Step
) -> list[Step]:
    """The same step so many times as long, where it gained more than it should: the valley is flatter than it looks."""
    trials = [moved(likelihood, point, free, factor * step.move) for factor in LONGER]
    return _judged(likelihood, point, free, normal, robust, trials, [step.damping] * len(LONGER))


def _judged(
    likelihood: Likelihood,
    point: Point,
    free: Ints,
    normal: tuple[Floats, Floats],
    robust: float,
    trials: list[Point],
    dampings: Sequence[float],
) -> list[Step]:
    hessian, gradient = normal
    found = []
    for trial, c, residual, damping in zip(trials, *cost(likelihood, trials, robust), dampings, strict=True):
        move = move_between(likelihood, point, trial, free)
        hoped = -float(gradient @ move + 0.5 * move @ hessian @ move)
        found.append(Step(replace(trial, cost=float(c)), residual, move, hoped, damping))
    return found


def lowest(steps: Sequence[Step]) -> Step:
    """The one that ends lowest."""
    return min(steps, key=lambda step: step.point.cost)


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

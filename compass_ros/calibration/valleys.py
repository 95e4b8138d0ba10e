"""Directions in which parameters cancel, asked of the simulator itself.

A puck's damping and those of all walls that it meets add up; one may grow for the others. Differences of each parameter
alone are exact to the simulator's roughness, and where large ones cancel, that roughness is what is left: it looks like
information, pins the parameters where they happen to stand, and makes their error bars too small.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from compass_ros.calibration.cost import Point, cost, robust_weight
from compass_ros.calibration.differences import Linear
from compass_ros.calibration.least_squares import moved
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.types import Bools, Floats, Ints

CANCELS = 0.1
"""Movement along a direction, as a share of what its parameters would do if they did not cancel."""
ROUNDS = 4
"""How often directions are asked, at most: a step is as short as roughness that has passed for information makes it,
and the next one, beside what it has shown, as long as the prior allows. Of two dampings that add up, rough by a
fiftieth of sigma, the difference has error bars of 0.03 of the prior's before, 0.57 after two, 1.00 after three."""
FARTHER, ELSEWHERE = 2.0, 0.3
"""What a direction must be to be asked then: so many times as long as those that were asked, or with so large a part
across them."""


def along_valleys(likelihood: Likelihood, point: Point, linear: Linear, free: Ints, robust: float) -> Linear:
    """Differences with those along cancelling directions measured over a standard deviation to each side.

    Less far where a bound is nearer: a step that one parameter cannot follow is across the valley. The rest stays as it
    is (Broyden 1965, with a measured secant for each direction).
    """
    p = len(free)
    jacobian = linear.jacobian.reshape(linear.residual.size, p).copy()
    weight = robust_weight(linear.residual, robust).reshape(-1, 1)
    launches = np.zeros(linear.launch_jacobian.shape[0] * linear.launch_jacobian.shape[-1])  # stay where they are
    asked = np.zeros((0, p))
    for _ in range(ROUNDS):
        directions = _valleys((jacobian * weight).T @ jacobian)
        directions = directions[_beyond(directions, asked)]
        if not len(directions):
            break
        asked = directions
        steps = [_within(likelihood, point, free, s) for d in directions for s in (d, -d)]
        sides = [moved(likelihood, point, free, np.concatenate([step, launches])) for step in steps]
        residuals = cost(likelihood, sides, robust)[1].reshape(len(directions), 2, -1)
        for (up, down), there, back in zip(residuals, sides[::2], sides[1::2], strict=True):
            secant = (there.values[free] - back.values[free]) / likelihood.prior_std[free]
            length = float(secant @ secant)
            if length > 0:
                jacobian += np.outer(up - down - jacobian @ secant, secant) / length
    return replace(linear, jacobian=jacobian.reshape(linear.jacobian.shape))


def _within(likelihood: Likelihood, point: Point, free: Ints, step: Floats) -> Floats:
    """(p,) of a step [standard deviations of the prior] as much as stays between the bounds."""
    change, at = step * likelihood.prior_std[free], point.values[free]
    room = np.where(change > 0, likelihood.high[free], likelihood.low[free]) - at
    moving = change != 0
    return np.asarray(step * min(1.0, float(np.min(room[moving] / change[moving], initial=1.0))))


def _beyond(directions: Floats, asked: Floats) -> Bools:
    """(d,) which of (d, p) directions say more than those that were asked: twice as far, or elsewhere."""
    if not len(asked):
        return np.ones(len(directions), bool)
    along = directions @ np.linalg.pinv(asked)  # in their lengths
    elsewhere = directions - along @ asked
    longer = np.linalg.norm(along, axis=1) > FARTHER
    return np.asarray(longer | (np.linalg.norm(elsewhere, axis=1) > ELSEWHERE * np.linalg.norm(directions, axis=1)))


def _valleys(gram: Floats) -> Floats:
    """(d, p) directions in which the parameters cancel, each a posterior standard deviation long."""
    information, vectors = np.linalg.eigh(gram)
    information = np.maximum(information, 0.0)
    apart = np.sum(vectors**2 * np.diag(gram)[:, None], axis=0)
    cancel = (information < CANCELS**2 * apart) & (apart > 1.0)
    return np.asarray((vectors[:, cancel] / np.sqrt(1 + information[cancel])).T)

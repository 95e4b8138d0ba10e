"""The end of a fit: the last steps to its optimum."""

from __future__ import annotations

from dataclasses import replace

from compass_ros.calibration.cost import Point, cost
from compass_ros.calibration.differences import Linear, broyden, central, difference_steps, linearise
from compass_ros.calibration.least_squares import Fit, lowest, normal_equations, stretched, tried
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.valleys import along_valleys
from compass_ros.types import Ints

SETTLING = 6
"""How often differences are taken at the end, at most: a budget."""
SERVE = 8
"""Steps that they serve, at most: a budget."""
BENDS = 4
"""How often a valley along which parameters cancel is asked anew beside the same differences, at most: a budget. It
bends, and asking it costs a quarter of them. On that arm one set of differences ends at 15,062 with them and at 15,096
without; after three it is at 15,046.5."""
FINE = (0.1, 0.03)
"""Lengths of these differences, in turn, as shares of those that move the residual by one sigma. The short ones are
exact; the long ones see past what the simulator's steps at contacts do to a short one. None is shorter than its
roughness."""
SETTLED = 0.3
"""Fall of the cost [log likelihood] by a step, or by all steps with the same differences, that is the last one: models
are compared by whole units."""
WORTHWHILE = 0.05
"""Share of what is left above the noise that all steps with the same differences must gain: where something else
differs, exact values are of no use. A budget."""
_DAMPING = (1e-9, 1e-3, 1e-2, 1e-1, 1.0, 1e1)
"""Damping factors that are tried at once at the end."""


def settled(likelihood: Likelihood, fit: Fit) -> Fit:
    """The last steps to the optimum: Gauss-Newton with short differences, which serve several steps.

    Along a valley that coupled parameters share, their effects cancel to a hundredth. Differences that are wrong by
    some per cent, as those of `minimise` are, end there, tens of log likelihood above the optimum. What a step has
    shown is added to them (Broyden): the shapes of a field bend the valley. Where the simulator is smooth the short
    ones are exact enough from one side (a seven-joint arm ends at 14,756.04 with either); elsewhere they are central,
    with both lengths in turn. Valleys are followed with the differences across them as they are.
    """
    rounds = 1 if likelihood.smooth else len(FINE)
    free, robust, linear = fit.free, fit.robust, fit.linear
    point = replace(fit.point, cost=float(cost(likelihood, [fit.point], robust)[0][0]))
    for taken in range(SETTLING):
        before = point.cost
        length = FINE[-1] if likelihood.smooth else max(FINE[taken % len(FINE)], likelihood.roughness)
        take = linearise if likelihood.smooth else central
        linear = take(likelihood, point, free, length * difference_steps(linear), linear.onset)
        for _ in range(BENDS):
            begun = point.cost
            linear = along_valleys(likelihood, point, linear, free, robust)
            point, linear = _served(likelihood, point, linear, free, robust)
            if begun - point.cost < _last(likelihood, point):
                break
        if taken >= rounds - 1 and before - point.cost < _last(likelihood, point):
            break
    return replace(fit, point=point, linear=linear)


def _last(likelihood: Likelihood, point: Point) -> float:
    """Fall of the cost up to which differences need not be taken again."""
    return max(SETTLED, WORTHWHILE * (point.cost - 0.5 * likelihood.measurements))


def _served(likelihood: Likelihood, point: Point, linear: Linear, free: Ints, robust: float) -> tuple[Point, Linear]:
    """Where steps by the same differences lead, and these with what the steps have shown."""
    for _ in range(SERVE):
        normal = normal_equations(likelihood, point, linear, free, robust)
        best = lowest(tried(likelihood, point, free, normal, robust, _DAMPING))
        if point.cost - best.point.cost > max(best.hoped, SETTLED):
            best = lowest([best, *stretched(likelihood, point, free, normal, robust, best)])
        step = point.cost - best.point.cost
        if step <= 0:
            break
        point = best.point
        if step < SETTLED:  # over a step as short as this differences show the simulator's roughness
            return point, replace(linear, residual=best.residual)
        linear = broyden(linear, best.residual, best.move)
    return point, linear

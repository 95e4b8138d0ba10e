"""Does what is left go away with another time step, friction, cone or solver? How sure are laws beside a time step?"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from compass_ros.calibration.cost import robust_weight
from compass_ros.calibration.least_squares import minimise, normal_equations
from compass_ros.calibration.residuals import residual_at
from compass_ros.cells import Cell
from compass_ros.discovery.hypothesis import Hypothesis, played
from compass_ros.discovery.nuisances import creeping_joints, finite_step, moved_by
from compass_ros.discovery.sized import log_alone
from compass_ros.simulation import Simulator
from compass_ros.simulation.numerics import other_numerics
from compass_ros.types import Floats

SHORTER = 0.25
"""Of the time step: a budget, for a calibration takes four times as long with a quarter of it."""
STEPS = 10
"""Gauss-Newton steps with other numerics, from the fit with the scene's: a budget."""


def with_numerics(model: Hypothesis) -> Floats:
    """(P + Q,) standard deviations, those of laws with what half the time step does to them.

    What a law is said to be is a claim about physics, and a simulator with a finite step says it not quite right; the
    parameters are those of this simulator.
    """
    simulator, likelihood, fit = model.simulator, model.likelihood, model.fit
    moved = 0.5 * finite_step(simulator, likelihood, fit.point, fit.linear.residual)
    weight = robust_weight(fit.linear.residual, fit.robust)
    hessian, _ = normal_equations(likelihood, fit.point, fit.linear, fit.free, fit.robust)
    pull = np.einsum("efcp,efc->p", fit.linear.jacobian, weight * moved)
    shift = -np.linalg.solve(hessian, np.pad(pull, (0, len(hessian) - len(pull))))[: len(pull)]
    std = model.std.copy()
    of_laws = fit.free >= len(simulator.cell.parameters)
    chosen = fit.free[of_laws]
    std[chosen] = np.hypot(std[chosen], shift[of_laws] * likelihood.prior_std[chosen])
    return std


def shorter_step(plain: Hypothesis, best: float, threshold: float) -> Cell | None:
    """The cell with a shorter time step, with which the plain model has higher log odds than the `best` model against
    it as it is.

    What a step does to first order is a nuisance of every model. A glancing contact is another one with another step:
    of such, halving the step does not foretell what a quarter of it does (`finite_step`: three quarters of all). Where
    that is wrong by less than the `threshold` of log odds, nothing is fitted; nor where it does too little: at an
    optimum a change m of the residual r lowers half its square by -r m at most to first order, whatever parameters then
    do, and so by |r| |m| (Cauchy and Schwarz), each weighted as in the robust loss.
    """
    finer = replace(plain.simulator.cell, time_step=SHORTER * plain.simulator.time_step)
    whole = finite_step(plain.simulator, plain.likelihood, plain.fit.point, plain.fit.linear.residual)
    other = _simulated(plain, finer, (1 - SHORTER) * whole, threshold, best)
    return finer if other and _gained(plain, other) > best else None


def friction_that_holds(plain: Hypothesis, threshold: float) -> Cell | None:
    """The cell with dry friction that holds a joint at rest, where the plain model is more probable with it by more
    than a `threshold` of log odds.

    Nature's friction holds, and the engine's is a soft constraint, under which a joint creeps. To first order that is a
    nuisance of every model; a joint that sticks and then jumps is another motion. Both have the same parameters.
    """
    if not creeping_joints(plain.simulator, plain.fit.point.values):
        return None
    held = replace(plain.simulator.cell, holds=True)
    other = _simulated(plain, held, np.zeros(1), threshold, threshold)
    if other is None or _gained(plain, other) <= threshold:
        return None
    before, after = (log_alone(h.response.tangent) for h in (plain, other))
    return held if after - before > threshold else None


def _simulated(plain: Hypothesis, cell: Cell, foretold: Floats, surprise: float, best: float) -> Hypothesis | None:
    """The plain model fitted anew with a cell of other numerics, or as it is where that gains more than `best` of log
    likelihood; None where these cannot, or do what is `foretold` (E, F, C) but for less than the `surprise` [log
    odds]."""
    simulator, likelihood, fit = plain.simulator, plain.likelihood, plain.fit
    other = Simulator(cell, threads=simulator.threads).driven(simulator.physics.bank)
    beside = played(likelihood, other)
    residual, kappa = fit.linear.residual, likelihood.correlation_time
    moved = residual_at(beside, fit.point) - residual
    if 0.5 * float(np.sum((moved - foretold) ** 2)) / kappa < surprise:
        return None
    weighted = np.sqrt(robust_weight(residual, fit.robust))
    if float(np.linalg.norm(weighted * residual) * np.linalg.norm(weighted * moved)) / kappa <= best:
        return None
    begun = minimise(beside, fit.point, fit.free, 0, fit.robust)
    found = Hypothesis((), other, beside, begun)
    if _gained(plain, found) > best:
        return found  # a fit would only add to it
    return replace(found, fit=minimise(beside, fit.point, fit.free, STEPS, fit.robust, 1.0, begun.linear))


def _gained(plain: Hypothesis, other: Hypothesis) -> float:
    """Log likelihood by other numerics."""
    return (plain.fit.point.cost - other.fit.point.cost) / plain.likelihood.correlation_time


def numerics_as_model(plain: Hypothesis, best: float) -> str:
    """Which change of numerics has higher log odds than the `best` model against the plain one; empty: none.

    What it moves is taken as it is, to first order beside the parameters: a model without a number of its own.
    """
    tangent, shape = plain.response.tangent, plain.response.tangent.residual.shape
    for what, options in other_numerics(plain.simulator.options):
        moved = moved_by(plain.simulator, plain.likelihood, plain.fit.point, plain.fit.linear.residual, options)
        changed = replace(tangent, residual=tangent.residual + moved.reshape(shape))
        if log_alone(changed) - plain.free.alone > best:
            return f"what is left goes away with {what}"
    return ""

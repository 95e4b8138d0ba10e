"""Is what is left physics, or does it go away with another time step, friction cone or solver?"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from compass_ros.calibration.cost import robust_weight
from compass_ros.calibration.least_squares import Fit, normal_equations
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.discovery.evidence import solve
from compass_ros.discovery.hypothesis import Hypothesis
from compass_ros.simulation import Simulator
from compass_ros.simulation.numerics import other_numerics
from compass_ros.types import Floats


def with_numerics(model: Hypothesis) -> Floats:
    """(P + Q,) standard deviations, those of laws with what half the time step does to them.

    What a law is said to be is a claim about physics, and a simulator with a finite step says it not quite right; the
    parameters are those of this simulator.
    """
    simulator, likelihood, fit = model.simulator, model.likelihood, model.fit
    moved = _moved(simulator, likelihood, fit, {"timestep": 0.5 * simulator.options.timestep})
    weight = robust_weight(fit.linear.residual, fit.robust)
    hessian, _ = normal_equations(likelihood, fit.point, fit.linear, fit.free, fit.robust)
    pull = np.einsum("efcp,efc->p", fit.linear.jacobian, weight * moved)
    shift = -np.linalg.solve(hessian, np.pad(pull, (0, len(hessian) - len(pull))))[: len(pull)]
    std = model.std.copy()
    of_laws = fit.free >= len(simulator.cell.parameters)
    chosen = fit.free[of_laws]
    std[chosen] = np.hypot(std[chosen], shift[of_laws] * likelihood.prior_std[chosen])
    return std


def _moved(simulator: Simulator, likelihood: Likelihood, fit: Fit, options: Mapping[str, float]) -> Floats:
    """(E, F, C) change of the residual by other numerics [sigma]; 0 where nothing was measured."""
    other = Simulator(simulator.cell, simulator.effects, simulator.threads, options).driven(simulator.physics.bank)
    values = np.tile(fit.point.values, (len(likelihood.inputs), 1))
    inputs = likelihood.inputs + fit.point.launch
    change = other.observe(values, inputs, likelihood.time_s) - simulator.observe(values, inputs, likelihood.time_s)
    return np.where(np.isnan(likelihood.measured), 0.0, change / likelihood.sigma)


def numerics_as_model(plain: Hypothesis, best: float) -> str:
    """Which change of numerics has higher log odds than the `best` model against the plain one; empty: none.

    What it moves is taken as it is, to first order beside the parameters: a model without a number of its own.
    """
    tangent, shape = plain.response.tangent, plain.response.tangent.residual.shape
    for what, options in other_numerics(plain.simulator):
        moved = _moved(plain.simulator, plain.likelihood, plain.fit, options)
        changed = replace(tangent, residual=tangent.residual + np.nan_to_num(moved).reshape(shape))
        if solve(changed, changed.normal, None).log - plain.free.alone > best:
            return f"what is left goes away with {what}"
    return ""

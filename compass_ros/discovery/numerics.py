"""Is what is left physics, or does it go away with another time step, friction cone or solver?"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from compass_ros.discovery.evidence import solve
from compass_ros.discovery.hypothesis import Hypothesis
from compass_ros.simulation import Simulator
from compass_ros.simulation.numerics import other_numerics
from compass_ros.types import Floats


def numerical_cause(plain: Hypothesis, best: float) -> str:
    """Which change of numerics has higher log odds than the `best` model against the plain one; empty: none.

    The calibrated simulator plays the fitted episodes again with other numerics. What that moves is taken as it is, to
    first order beside the parameters: a model without a number of its own.
    """
    tangent = plain.response.tangent
    for what, options in other_numerics(plain.simulator):
        changed = replace(tangent, residual=tangent.residual + _moved(plain, options))
        odds = solve(changed, changed.normal, None).log - plain.free.alone
        if odds > best:
            return f"what is left goes away with {what}"
    return ""


def _moved(plain: Hypothesis, options: Mapping[str, float]) -> Floats:
    """(E, D) change of the residual by other numerics [sigma]."""
    likelihood, simulator, point = plain.likelihood, plain.simulator, plain.fit.point
    other = Simulator(simulator.cell, simulator.effects, simulator.threads, options).driven(simulator.physics.bank)
    values = np.tile(point.values, (len(likelihood.inputs), 1))
    inputs = likelihood.inputs + point.launch
    there, here = (s.observe(values, inputs, likelihood.time_s) for s in (other, simulator))
    change = np.nan_to_num((there - here) / likelihood.sigma)
    change = np.where(np.isnan(likelihood.measured), 0.0, change)
    return np.asarray(change.reshape(len(change), -1))

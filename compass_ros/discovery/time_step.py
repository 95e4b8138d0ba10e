"""What the finite time step of a simulator does to its predictions: nature has none."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from compass_ros.calibration.least_squares import Fit
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.residuals import residual_at
from compass_ros.simulation import Simulator
from compass_ros.types import Floats


def finite_step(simulator: Simulator, likelihood: Likelihood, fit: Fit) -> Floats:
    """(E, F, C) change of the residual towards no time step [sigma].

    MuJoCo's usual integrators are of first order, so half a step takes half of the error away, and twice that change is
    all of it (Richardson 1911). A mass that falls from rest is half a step early, as is an arm behind its commands.
    """
    return 2 * moved_by(simulator, likelihood, fit, {"timestep": 0.5 * simulator.options.timestep})


def moved_by(simulator: Simulator, likelihood: Likelihood, fit: Fit, options: Mapping[str, float]) -> Floats:
    """(E, F, C) change of the residual by other numerics [sigma]; 0 where nothing was measured."""
    other = Simulator(simulator.cell, simulator.effects, simulator.threads, options).driven(simulator.physics.bank)
    return residual_at(replace(likelihood, predict=other.observe), fit.point) - fit.linear.residual

"""What the engine's approximations do to predictions: nature has no time step, and dry friction that does not creep."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from compass_ros.calibration.least_squares import Fit
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.residuals import residual_at
from compass_ros.simulation import Simulator
from compass_ros.simulation.numerics import CONTACTS, creeping
from compass_ros.simulation.sites import JOINTS
from compass_ros.types import Floats

SOFTER = (0.5, 0.0)
"""Shares of the regularisation of dry friction: half, as engines may differ, and none, as in nature. What they do is
not the same: half of it moves a seven-joint arm by 0.1 to 0.25 mrad, all by 0.27 to 0.6, with correlations of 0.75 to
0.96. Half of that of contacts moves a pushed bar by 0.13 mm rms; two engines differ there by 0.1 to 0.3
(docs/worlds.md)."""
IMPRATIO = 10.0
"""Factor on the stiffness of friction over that of contacts: MuJoCo's documentation names it against slip. Ten times
moves that bar by 0.25 mm rms."""


def nuisances(simulator: Simulator, likelihood: Likelihood, fit: Fit) -> Floats:
    """(E, F, C, N) changes of the residual [sigma] by approximations of the engine, each one standard deviation of a
    nuisance of every model: the finite step, how soft each joint's dry friction is, and contacts and their friction."""
    moved = partial(moved_by, simulator, likelihood, fit)
    columns = [finite_step(simulator, likelihood, fit)]
    joints = [site.name for site in simulator.moving.values() if site.kind in JOINTS]
    for joint in creeping(simulator.written(fit.point.values), joints):
        columns += [moved(softness={joint: share}) for share in SOFTER]
    if simulator.places.touching:
        columns.append(moved(softness={CONTACTS: SOFTER[0]}))
        columns.append(moved({"impratio": IMPRATIO * simulator.options.impratio}))
    return np.stack(columns, axis=-1)


def finite_step(simulator: Simulator, likelihood: Likelihood, fit: Fit) -> Floats:
    """(E, F, C) change of the residual towards no time step [sigma].

    MuJoCo's usual integrators are of first order, so half a step takes half of the error away, and twice that change is
    all of it (Richardson 1911). A mass that falls from rest is half a step early, as is an arm behind its commands.
    """
    return 2 * moved_by(simulator, likelihood, fit, {"timestep": 0.5 * simulator.options.timestep})


def moved_by(
    simulator: Simulator, likelihood: Likelihood, fit: Fit, options: Mapping[str, float] | None = None,
    softness: Mapping[str, float] | None = None,
) -> Floats:  # fmt: skip
    """(E, F, C) change of the residual by other numerics [sigma] (`Simulator`); 0 where nothing was measured."""
    other = Simulator(simulator.cell, simulator.effects, simulator.threads, options, softness)
    played = other.driven(simulator.physics.bank)
    return residual_at(replace(likelihood, predict=played.observe), fit.point) - fit.linear.residual

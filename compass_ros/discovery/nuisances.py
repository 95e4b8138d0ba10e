"""What predictions may be off by with any physics: by the engine's approximations, for nature has no time step and dry
friction that does not creep, and by what a sensor states of itself beyond its scatter."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.spatial.distance import cdist

from compass_ros.calibration.cost import Point
from compass_ros.calibration.least_squares import Fit
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.residuals import residual_at
from compass_ros.cells import Cell
from compass_ros.discovery.settings import KEPT
from compass_ros.simulation import Simulator
from compass_ros.simulation.numerics import CONTACTS, creeping
from compass_ros.simulation.site_kinds import JOINTS
from compass_ros.types import Floats, Ints

SOFTER = (0.5, 0.0)
"""Shares of the regularisation of dry friction: half, as engines may differ, and none, as in nature. What they do is
not the same: half of it moves a seven-joint arm by 0.1 to 0.25 mrad, all by 0.27 to 0.6, with correlations of 0.75 to
0.96. Half of that of contacts moves a pushed bar by 0.13 mm rms; two engines differ there by 0.1 to 0.3
(docs/worlds.md)."""
IMPRATIO = 10.0
"""Factor on the stiffness of friction over that of contacts: MuJoCo's documentation names it against slip. Ten times
moves that bar by 0.25 mm rms."""
LENGTH = 3**0.5
"""Over which a sensor's stated error changes, as a share of the standard deviation of the places that were visited:
half of what is seen, were it visited evenly. A frame that is not level, a scale, a lens are one bend over it."""
DRAWN = 300
"""Places from which its components are found: a budget. Of 6,000 in a square, 100, 300 and 1000 find 10, 10 and 11 of
them, whose size is that of the process to 2 %."""


def nuisances(simulator: Simulator, likelihood: Likelihood, fit: Fit) -> Floats:
    """(E, F, C, N) changes of the residual [sigma] by approximations of the engine, each one standard deviation of a
    nuisance of every model: the finite step, how soft each joint's dry friction is, contacts and their friction; and by
    errors that a sensor states.

    What the step does to a contact is another thing each time, for contacts fall into a step by chance: on a table of
    another engine with nothing missing it was +0.18 of that column in one glancing shot and -0.14 in another
    (correlations of 0.84 and -0.79 with what was left). So the first column is one of each episode as well where
    things touch.
    """
    moved = partial(moved_by, simulator, likelihood, fit.point, fit.linear.residual)
    columns = [finite_step(simulator, likelihood, fit.point, fit.linear.residual)]
    for joint in creeping_joints(simulator, fit.point.values):
        columns += [moved(softness={joint: share}) for share in SOFTER]
    if simulator.places.touching:
        columns.append(moved(softness={CONTACTS: SOFTER[0]}))
        columns.append(moved({"impratio": IMPRATIO * simulator.options.impratio}))
    return np.concatenate([np.stack(columns, axis=-1), stated_errors(simulator.cell, likelihood)], axis=-1)


def creeping_joints(simulator: Simulator, values: Floats) -> tuple[str, ...]:
    """Those whose dry friction at (P,) values is the engine's soft constraint."""
    joints = [site.name for site in simulator.moving.values() if site.kind in JOINTS]
    return () if simulator.cell.holds else creeping(simulator.written(values), joints)


def stated_errors(cell: Cell, likelihood: Likelihood) -> Floats:
    """(E, F, C, N) changes of the residual [sigma] by what a sensor states of itself beyond its scatter
    (`Likelihood.systematic`): an error of each number, alike wherever the same place is seen again.

    A Gaussian process over the place (of a joint over its angle) with a squared exponential kernel, by its leading
    components among the places that were visited (Nystrom's method; Rasmussen and Williams 2006, section 8.1).
    """
    shape = likelihood.measured.shape
    systematic = np.zeros(shape[2]) if likelihood.systematic is None else likelihood.systematic
    out = [np.zeros((*shape, 0))]
    for columns in _stated(cell, systematic):
        here = ~np.isnan(likelihood.measured[..., columns]).any(axis=2)
        if not here.any():
            continue
        functions = _components(likelihood.measured[..., columns][here])
        for column in columns:
            change = np.zeros((*shape, functions.shape[1]))
            change[here, column] = functions * (systematic[column] / likelihood.sigma[..., column][here])[:, None]
            out.append(change)
    return np.concatenate(out, axis=-1)


def _stated(cell: Cell, stated: Floats) -> Iterator[Ints]:
    """Columns with a stated error that say one place together; of joints each alone."""
    for one in (np.array(columns) for signal in cell.signals for columns in signal.together):
        if np.any(stated[one] > 0):
            yield one[stated[one] > 0]


def _components(places: Floats) -> Floats:
    """(n, m) functions of (n, a) places whose sum, with coefficients N(0, 1), is a Gaussian process of variance 1."""
    spread = places.std(axis=0)
    at = places / np.where(spread > 0, LENGTH * spread, 1.0)
    some = at[np.unique(np.linspace(0, len(at) - 1, DRAWN).astype(int))]
    variance, axes = np.linalg.eigh(np.exp(-0.5 * cdist(some, some, "sqeuclidean")))
    kept = variance > KEPT * variance[-1]
    return np.asarray(np.exp(-0.5 * cdist(at, some, "sqeuclidean")) @ (axes[:, kept] / np.sqrt(variance[kept])))


def finite_step(simulator: Simulator, likelihood: Likelihood, point: Point, residual: Floats) -> Floats:
    """(E, F, C) change of the residual towards no time step [sigma].

    MuJoCo's usual integrators are of first order, so half a step takes half of the error away, and twice that change is
    all of it (Richardson 1911). A mass that falls from rest is half a step early, as is an arm behind its commands.
    """
    return 2 * moved_by(simulator, likelihood, point, residual, {"timestep": 0.5 * simulator.options.timestep})


def moved_by(
    simulator: Simulator, likelihood: Likelihood, point: Point, residual: Floats,
    options: Mapping[str, float] | None = None, softness: Mapping[str, float] | None = None,
) -> Floats:  # fmt: skip
    """(E, F, C) change of the residual at a point by other numerics [sigma] (`Simulator`); 0 where nothing was
    measured."""
    other = Simulator(simulator.cell, simulator.effects, simulator.threads, options, softness)
    played = other.driven(simulator.physics.bank)
    return residual_at(replace(likelihood, predict=played.observe), point) - residual

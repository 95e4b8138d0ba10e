"""Recordings of the air-hockey table with planted physics, linearised at the defaults; few shots and parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from compass_ros.calibration.cost import ROBUST, Point, start
from compass_ros.calibration.differences import linearise
from compass_ros.calibration.least_squares import Fit
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.discovery.candidates import Candidate, candidates
from compass_ros.discovery.hypothesis import Hypothesis, widened
from compass_ros.discovery.response import Response, respond
from compass_ros.planning.planned import perfect
from compass_ros.simulation.effects import Attached
from compass_ros.types import Floats
from test.simulation.table import cell, simulator

CALM = np.array([[-0.206, -0.08, 0.163, 0.385], [-0.252, 0.051, 0.157, 0.376], [-0.193, 0.05, -0.154, 0.33]])
"""Three shots that amplify little: what is planted moves the pucks as its tangent says."""
HELD_OUT = np.array([[-0.198, 0.045, 0.208, 0.242], [-0.248, -0.053, 0.242, 0.775]])
"""Two more."""
PUCKS = ("puck1", "puck2")
SIGMA = 1e-3
RATE = 30.0
FREE = (
    "puck1@dyna@friction_sliding",
    "puck2@dyna@friction_sliding",
    "pusher@actuation@vel_discount",
    "env@camera@bias_x",
    "env@camera@bias_y",
)


@cache
def asked_of_table() -> tuple[Candidate, ...]:
    """All laws that can act there."""
    return candidates(simulator(), simulator().defaults, CALM, np.tile(np.linspace(0, 2.5, 50), (len(CALM), 1)))


def recorded(effect: Attached | None, numbers: Sequence[float], shots: Floats = CALM, seed: int = 0) -> Likelihood:
    """Shots on a table with an effect, with noise."""
    return recorded_with([effect] if effect else [], numbers, shots, seed)


def recorded_with(
    effects: Sequence[Attached], numbers: Sequence[float] | Floats, shots: Floats = CALM, seed: int = 0
) -> Likelihood:
    """The same with several; `numbers` are those of all in their order, or (E, q) other ones in each shot."""
    clean = perfect(simulator(), shots, RATE, SIGMA)
    wider = simulator().with_effects(effects)
    of_effects = np.broadcast_to(numbers, (len(shots), np.shape(numbers)[-1]))
    values = np.hstack([np.tile(simulator().defaults, (len(shots), 1)), of_effects])
    measured = wider.observe(values, shots, clean.time_s)
    return replace(clean, measured=measured + np.random.default_rng(seed).normal(0, SIGMA, measured.shape))


def response_of(likelihood: Likelihood) -> Response:
    """Tangents at the defaults, where the fit would have begun."""
    free = np.array([cell().index(name) for name in FREE])
    point = start(likelihood, simulator().defaults)
    fit = Fit(point, linearise(likelihood, point, free, np.full(len(free), 0.02)), free, 1e3 * ROBUST, 0, True)
    return respond(simulator(), likelihood, fit)


@cache
def planned_response() -> Response:
    """Three perfect shots."""
    return response_of(perfect(simulator(), CALM, RATE, SIGMA))


def model(response: Response, effect: Attached, numbers: Sequence[float]) -> Hypothesis:
    """A fit that ended at the defaults with the given effect."""
    wider, likelihood = widened(simulator(), response.likelihood, [effect])
    known = len(simulator().defaults)
    free = np.concatenate([response.fit.free, known + np.arange(len(numbers))])
    point = Point(np.concatenate([simulator().defaults, numbers]), response.fit.point.launch, 0.0)
    linear = linearise(likelihood, point, free, np.full(len(free), 0.02))
    return Hypothesis((effect,), wider, likelihood, Fit(point, linear, free, ROBUST, 0, True))

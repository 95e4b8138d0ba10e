"""What another time step explains is said to be that; drag is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from compass_ros.discovery.hypothesis import Hypothesis
from compass_ros.discovery.numerics import numerics_as_model
from compass_ros.discovery.planned import perfect
from compass_ros.discovery.response import Response
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import EFFECTS, Attached
from test.discovery.planted import CALM, PUCKS, RATE, SIGMA, recorded, response_of
from test.simulation.table import cell, simulator


def cause(response: Response) -> str:
    plain = Hypothesis((), response.simulator, response.likelihood, response.fit)
    return numerics_as_model(plain, plain.free.log - plain.free.alone)


def test_a_finer_time_step_is_told_from_physics() -> None:
    clean = perfect(simulator(), CALM, RATE, 0.01 * SIGMA)
    finer = Simulator(cell(), options={"timestep": 0.5 * simulator().time_step})
    measured = finer.observe(np.tile(simulator().defaults, (len(CALM), 1)), CALM, clean.time_s)
    assert "half the time step (0.5 ms)" in cause(response_of(replace(clean, measured=measured)))


def test_missing_drag_is_no_numerics() -> None:
    assert cause(response_of(recorded(Attached(EFFECTS["viscous_drag"], PUCKS), [0.3]))) == ""

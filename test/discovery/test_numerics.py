"""What another time step explains is said to be that; drag is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from compass_ros.discovery.numerics import numerical_cause
from compass_ros.discovery.planned import perfect
from compass_ros.discovery.screen import Space
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import EFFECTS, Attached
from test.discovery.planted import CALM, PUCKS, RATE, SIGMA, recorded, space_of
from test.simulation.table import cell, simulator


def left(space: Space) -> float:
    """Cost that the parameters cannot take."""
    return 0.5 * float(np.sum(space.off_parameters(space.residual[:, None]) ** 2))


def test_a_finer_time_step_is_told_from_physics() -> None:
    clean = perfect(simulator(), CALM, RATE, SIGMA)
    finer = Simulator(cell(), options={"timestep": 0.5 * simulator().time_step})
    measured = finer.observe(np.tile(simulator().defaults, (len(CALM), 1)), CALM, clean.time_s)
    space = space_of(replace(clean, measured=measured))
    assert left(space) > 0
    assert "half the time step (0.5 ms)" in numerical_cause(space, left(space))


def test_missing_drag_is_no_numerics() -> None:
    space = space_of(recorded(Attached(EFFECTS["viscous_drag"], PUCKS), [0.3]))
    assert numerical_cause(space, left(space)) == ""

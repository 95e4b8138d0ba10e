"""Trajectories are smooth in the parameters: the condition for every fit and for every verdict that rests on one."""

from __future__ import annotations

import numpy as np
import pytest

from compass_ros.types import Floats
from test.simulation.table import actions, cell, simulator

POINTS = 21
STRONG = (
    "puck1@dyna@friction_sliding",
    "puck2@dyna@friction_sliding",
    "puck1@dyna@damping",
    "puck2@dyna@damping",
    "right_wall@dyna@damping",
    "pusher@actuation@vel_discount",
)


def not_smooth(name: str, shots: Floats) -> Floats:
    """(S,) rms of what a cubic leaves of the final positions, in metres, over a sweep of 1 % of a parameter."""
    column = cell().index(name)
    sweep = cell().defaults[column] * (1 + 0.01 * np.linspace(-0.5, 0.5, POINTS))
    values = np.tile(cell().defaults, (POINTS, 1))
    values[:, column] = sweep
    tiled = np.tile(values, (len(shots), 1))
    end = simulator().motion(tiled, np.repeat(shots, POINTS, axis=0), cell().duration).positions[:, -1]
    of_shot = end.reshape(len(shots), POINTS, -1)
    basis = np.vander(np.linspace(-1, 1, POINTS), 4)
    left = of_shot - basis @ (np.linalg.pinv(basis) @ of_shot)
    return np.asarray(np.sqrt(np.mean(left**2, axis=1)).max(axis=1))


@pytest.fixture(scope="module")
def rough() -> dict[str, Floats]:
    """(S,) by parameter, on shots of the paper's action box."""
    return {name: not_smooth(name, actions(4, seed=5)) for name in STRONG}


def test_final_positions_are_smooth_on_the_papers_shots(rough: dict[str, Floats]) -> None:
    """Median under 0.05 mm: a twentieth of the noise of one frame. Measured 0.006 mm (16 shots)."""
    assert np.median(list(rough.values())) < 5e-5


@pytest.mark.parametrize("name", STRONG)
def test_no_parameter_is_rough(rough: dict[str, Floats], name: str) -> None:
    """Measured medians: 0.05 mm for the speed of the arm, which every later collision amplifies, 0.01 mm for others."""
    assert np.median(rough[name]) < (1.5e-4 if name.endswith("vel_discount") else 5e-5)


def test_the_measure_notices_a_step() -> None:
    """The same figure for a made trajectory that jumps by 1 mm in mid-sweep."""
    basis = np.vander(np.linspace(-1, 1, POINTS), 4)
    jump = np.where(np.linspace(-1, 1, POINTS) > 0.1, 1e-3, 0.0)
    assert np.sqrt(np.mean((jump - basis @ np.linalg.pinv(basis) @ jump) ** 2)) > 1e-4

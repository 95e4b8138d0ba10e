"""The shot that the paper describes, its causes, and a scene that can be fitted."""

from __future__ import annotations

import numpy as np
import pytest

from compass_ros.cells import Cell, load
from compass_ros.simulation import Simulator
from compass_ros.simulation.factors import factor_distance
from compass_ros.types import Floats

CELL = load("bouncing_ball")
CAUSES = ["ball@dyna@damping", "ball@dyna@mass", "plate1@dyna@damping", "plate2@dyna@damping"]


def rollout(values: Floats, height: Floats, steps: int = CELL.horizon) -> Floats:
    """(B, T, 3) the ball on the control grid."""
    time = np.tile(CELL.control_dt * np.arange(steps + 1), (len(values), 1))
    return Simulator(CELL).observe(values, height[:, None], time)


def moved(cell: Cell, heights: Floats) -> Floats:
    """(P,) mean distance from the nominal trajectory, when each parameter goes one half width up."""
    base = rollout(np.tile(cell.defaults, (len(heights), 1)), heights)
    changes = np.diag([p.half_width if p.default + p.half_width <= p.high else -p.half_width for p in cell.parameters])
    values = np.repeat(cell.defaults + changes, len(heights), axis=0)
    seen = rollout(values, np.tile(heights, len(changes)))
    distance = factor_distance(cell, seen, np.tile(base, (len(changes), 1, 1)))[:, :, 0]
    return np.asarray(distance.mean(axis=1).reshape(len(changes), -1).max(axis=1))


def test_there_are_82_parameters_and_the_papers_four_are_the_causes() -> None:
    assert len(CELL.parameters) == 82
    assert list(CELL.spec.causal) == CAUSES
    assert {p.name for p in CELL.spec.parameters if p.target is not None} == set(CAUSES)


def test_the_ball_bounces_twice_and_falls_into_the_basket() -> None:
    middle = np.array([0.5 * (CELL.action[0].low + CELL.action[0].high)])
    x, _, z = rollout(CELL.defaults[None], middle, 40)[0].T
    lows = [i for i in range(1, len(z) - 1) if z[i] < z[i - 1] and z[i] <= z[i + 1]]
    assert np.abs(x[lows[0]] + 0.4) < 0.02, "on the first plate"
    assert np.abs(x[lows[1]] - 0.06) < 0.12, "on the second plate"
    rim, inside = 0.115, 0.065
    falls = np.flatnonzero((z[:-1] >= rim) & (z[1:] < rim))[-1]
    assert np.abs(x[falls] - 0.445) < inside, "from above"
    assert np.abs(x[-1] - 0.445) < inside
    assert z[-1] < rim


def test_the_four_causes_stand_out() -> None:
    effect = dict(zip([p.name for p in CELL.parameters], moved(CELL, np.array([0.28, 0.31])), strict=True))
    others = max(value for name, value in effect.items() if name not in CAUSES)
    assert min(effect[name] for name in CAUSES) > 10 * others


@pytest.mark.slow
def test_every_parameter_moves_the_ball_in_some_shot() -> None:
    heights = np.linspace(CELL.reach[0, 0], CELL.reach[0, 1], 12)
    still = [p.name for p, m in zip(CELL.parameters, moved(CELL, heights), strict=True) if m < 1e-8]
    assert still == []


@pytest.mark.parametrize("name", ["ball@dyna@damping", "ball@dyna@mass"])
def test_the_flight_is_smooth_in_the_causes(name: str) -> None:
    sweep = np.linspace(-1, 1, 15)
    values = np.tile(CELL.defaults, (15, 1))
    values[:, CELL.index(name)] *= 1 + 0.01 * sweep
    end = rollout(values, np.full(15, 0.301), 32)[:, -1]  # after both plates, before the basket
    powers = np.vander(sweep, 3)
    parabola = powers @ np.linalg.lstsq(powers, end, rcond=None)[0]
    assert np.ptp(end, axis=0).max() > 1e-3, "one percent can be seen"
    assert np.abs(end - parabola).max() < 2e-4


def test_a_heavier_ball_feels_less_of_the_air_and_of_the_rubber() -> None:
    values = np.tile(CELL.defaults, (2, 1))
    values[1, CELL.index("ball@dyna@mass")] *= 1.4
    falls = rollout(values, np.full(2, 0.5), 9)  # still in the air
    assert 1e-5 < falls[0, -1, 2] - falls[1, -1, 2] < 1e-3
    bounced = rollout(values, np.full(2, 0.3), 14)
    assert np.linalg.norm(bounced[0, -1] - bounced[1, -1]) > 0.005

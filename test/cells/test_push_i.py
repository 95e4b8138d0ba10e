"""The push that the paper describes, its causes, and a scene that can be fitted."""

from __future__ import annotations

import numpy as np
import pytest

from compass_ros.cells import load
from compass_ros.simulation import Simulator
from compass_ros.simulation.factors import factor_distance
from compass_ros.types import Floats

CELL = load("push_i")
CAUSES = ["cube@dyna@mass", "cube@dyna@damping", "cube@dyna@friction_sliding"]
LOW, HIGH = (np.array([getattr(a, side) for a in CELL.action]) for side in ("low", "high"))
STRAIGHT = np.array([0.2, 0.0, 0.0, 0.2, 0.0, 0.0])


def rollout(values: Floats, actions: Floats) -> Floats:
    """(B, T, 7) pose of the cube on the control grid."""
    time = np.tile(CELL.control_dt * np.arange(CELL.horizon + 1), (len(values), 1))
    return Simulator(CELL).observe(values, actions, time)


def moved(actions: Floats) -> Floats:
    """(P, K) largest change over the actions of each factor's mean distance, each parameter one half width up."""
    cell, n = CELL, len(actions)
    base = rollout(np.tile(cell.defaults, (n, 1)), actions)
    changes = np.diag([p.half_width if p.default + p.half_width <= p.high else -p.half_width for p in cell.parameters])
    seen = rollout(np.repeat(cell.defaults + changes, n, axis=0), np.tile(actions, (len(changes), 1)))
    distance = factor_distance(cell, seen, np.tile(base, (len(changes), 1, 1))).mean(axis=1)
    return np.asarray(distance.reshape(len(changes), n, -1).max(axis=1))


def test_there_are_67_parameters_and_the_papers_three_are_the_causes() -> None:
    assert len(CELL.parameters) == 67
    assert CELL.horizon == 30
    assert [f.name for f in CELL.factors] == ["position", "roll", "pitch", "yaw"]
    assert list(CELL.spec.causal) == CAUSES
    assert {p.name for p in CELL.spec.parameters if p.target is not None} == set(CAUSES)


def test_the_tool_pushes_the_cube_and_leaves_it_at_rest() -> None:
    seen = rollout(CELL.defaults[None], STRAIGHT[None])[0]
    assert np.abs(np.diff(seen[:2], axis=0)).max() < 1e-4, "it stands still until the tool comes"
    assert seen[-1, 0] > 0.05, "towards the target"
    assert np.abs(seen[-1] - seen[-2]).max() < 1e-4, "friction has stopped it"
    assert np.abs(seen[:, 2] - seen[0, 2]).max() < 0.002, "on the table"


def test_it_turns_about_the_vertical_and_hardly_rolls() -> None:
    """As the paper's figures: little can be seen in roll, whatever the parameters, the cube being long."""
    seen = rollout(CELL.defaults[None], STRAIGHT[None])
    roll, pitch, yaw = factor_distance(CELL, seen, np.tile(seen[:, :1], (1, seen.shape[1], 1)))[0, :, 1:].max(axis=0)
    assert yaw > 10 * pitch
    assert pitch > roll


def test_the_three_causes_stand_out() -> None:
    actions = np.random.default_rng(0).uniform(LOW, HIGH, (2, 6))
    effect = moved(actions)
    names = [p.name for p in CELL.parameters]
    others = np.array([e for name, e in zip(names, effect, strict=True) if name not in CAUSES])
    for name in CAUSES:
        assert (effect[names.index(name)] > 2.5 * others.max(axis=0)).any(), name


@pytest.mark.slow
def test_every_parameter_moves_the_cube_in_some_push() -> None:
    effect = moved(np.random.default_rng(1).uniform(LOW, HIGH, (3, 6))).max(axis=1)
    assert [p.name for p, e in zip(CELL.parameters, effect, strict=True) if e < 1e-8] == []


@pytest.mark.parametrize("name", ["cube@dyna@friction_sliding", "cube@dyna@mass"])
def test_the_push_is_smooth_in_the_causes(name: str) -> None:
    sweep = np.linspace(-1, 1, 15)
    values = np.tile(CELL.defaults, (15, 1))
    values[:, CELL.index(name)] *= 1 + 0.01 * sweep
    end = rollout(values, np.tile(STRAIGHT, (15, 1)))[:, -1]
    powers = np.vander(sweep, 3)
    parabola = powers @ np.linalg.lstsq(powers, end, rcond=None)[0]
    assert np.ptp(end, axis=0).max() > 1e-4, "one percent can be seen"
    assert np.abs(end - parabola).max() < 1e-4


def test_mass_and_friction_are_told_apart_by_the_slide_after_the_push() -> None:
    """Half the friction at twice the mass resists alike while pushed; alone it slides farther."""
    values = np.tile(CELL.defaults, (2, 1))
    values[1, CELL.index("cube@dyna@mass")] *= 1.6
    values[1, CELL.index("cube@dyna@friction_sliding")] = 0.1
    seen = rollout(values, np.tile(STRAIGHT, (2, 1)))
    assert np.linalg.norm(seen[0, -1, :3] - seen[1, -1, :3]) > 0.003

"""Shots of a demonstration: within reach, useful, and the same for the same seed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from compass_ros.cells import Cell, load
from compass_ros.demo.shots import APART_M, CLEAR_M, MOVED_M, draw_shots
from compass_ros.errors import ConfigError
from compass_ros.simulation import Simulator

REST = np.array([[-0.15, 0.0], [-0.075, -0.075]])


@pytest.fixture(scope="module")
def cell() -> Cell:
    return load("air_hockey")


def test_shots_are_within_reach_and_half_of_them_in_the_action_space(cell: Cell) -> None:
    shots = draw_shots(cell, 8, 3)
    rows = np.array([[shot[field.name] for field in cell.action] for shot in shots])
    assert np.all((rows >= cell.reach[:, 0]) & (rows <= cell.reach[:, 1]))
    box = np.array([(field.low, field.high) for field in cell.action])
    inside = np.all((rows >= box[:, 0] - 1e-4) & (rows <= box[:, 1] + 1e-4), axis=1)
    assert inside[::2].all()
    assert not inside.all()
    assert draw_shots(cell, 8, 3) == shots
    assert draw_shots(cell, 8, 4) != shots


def test_every_shot_moves_a_puck_and_comes_out_alike_again(cell: Cell) -> None:
    simulator = Simulator(cell)
    rows = np.array([list(shot.values()) for shot in draw_shots(cell, 6, 5)])
    distance = np.linalg.norm(rows[:, None, :2] - REST, axis=2)
    assert distance.min() >= CLEAR_M
    values, end = np.tile(cell.defaults, (len(rows), 1)), np.full((len(rows), 1), cell.duration)
    first = simulator.observe(values, rows, end)[:, 0]
    assert np.linalg.norm(first[:, :2] - REST[0], axis=1).min() >= MOVED_M
    again = simulator.observe(values, rows + np.array([1e-5, 1e-5, 1e-4, 1e-4]), end)[:, 0]
    assert np.abs(again - first).max() < APART_M


def test_a_cell_without_such_shots_is_refused() -> None:
    with pytest.raises(ConfigError, match="expected an action of x, y, angle and velocity"):
        draw_shots(load(Path(__file__).parents[2] / "config" / "cells" / "bouncing_ball.yaml"), 3, 0)

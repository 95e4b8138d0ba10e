"""Shots that are drawn, and their linearisation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from compass_ros.cells import load
from compass_ros.errors import ConfigError
from compass_ros.planning.planned import completed, draw, linearised, within_stroke, worth
from test.discovery.planted import CALM
from test.simulation.table import cell, simulator

REST = np.array([[-0.15, 0.0], [-0.075, -0.075]])


def test_drawn_shots_are_within_reach_and_clear_of_the_pucks_and_move_something() -> None:
    found = draw(simulator(), 4, np.random.default_rng(0))
    low, high = cell().reach.T
    assert ((found >= low) & (found <= high)).all()
    gap = np.linalg.norm(found[:, None, :2] - REST, axis=2) - 0.0255 - 0.03
    assert (gap > 0.003).all()
    assert (gap.min(axis=1) < 0.08).all()
    assert worth(simulator(), found, 1e-3).all()
    np.testing.assert_array_equal(found, draw(simulator(), 4, np.random.default_rng(0)))


def test_a_pusher_on_a_puck_and_one_that_misses_are_left_out() -> None:
    on_it, far_away = np.array([[-0.16, 0.01, 0, 0.5], [0.0, 0.16, 0, 0.5]])
    assert within_stroke(simulator(), np.stack([on_it, far_away, CALM[0]])).tolist() == [False, False, True]
    away = np.array([-0.24, 0.15, 0.4, 0.2])
    assert worth(simulator(), np.stack([away, CALM[0]]), 1e-3).tolist() == [False, True]


def test_perfect_recordings_leave_no_residual() -> None:
    response = linearised(simulator(), CALM[:1], 30.0, 1e-3)
    assert not response.tangent.residual.any()
    assert (response.likelihood.sigma >= 1e-3).all()
    assert response.tangent.parameters.shape[2] == len(cell().parameters) + 3  # and the engine's nuisances
    assert (np.linalg.norm(response.tangent.parameters, axis=(0, 1)) > 0).sum() > 35


def test_a_cell_without_commands_has_no_shots_to_plan() -> None:
    ball = load("bouncing_ball")
    assert completed(ball, np.array([[0.3]])).shape == (1, len(ball.input_names))
    with pytest.raises(ConfigError, match="no shots to plan"):
        completed(replace(ball, spec=replace(ball.spec, action=())), np.empty((1, 0)))

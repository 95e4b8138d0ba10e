"""Accelerations that are lacking, found again where they were planted."""

from __future__ import annotations

import numpy as np
import pytest

from compass_ros.discovery.maps import accelerations, residual_map
from compass_ros.discovery.screen import Space
from compass_ros.simulation.effects import EFFECTS, Attached
from test.discovery.planted import PUCKS, planned_space, recorded, space_of


@pytest.fixture(scope="module")
def tilted() -> Space:
    return space_of(recorded(Attached(EFFECTS["table_tilt"], PUCKS), [0.0, 0.01]))


def test_a_tilt_is_the_same_push_everywhere(tilted: Space) -> None:
    """0.01 of the weight, 0.098 m/s^2 along y, on pucks that move."""
    push = accelerations(tilted)
    moving = np.linalg.norm(tilted.pushes.paths[..., 2:], axis=3) > 0.05
    assert moving.sum() > 20
    assert np.median(push[moving][:, 1]) == pytest.approx(0.098, rel=0.25)
    assert abs(np.median(push[moving][:, 0])) < 0.02


def test_the_map_is_nan_where_nothing_passed_and_lies_on_the_table(tilted: Space) -> None:
    found = residual_map(tilted)
    assert found is not None
    assert found.value.shape == (len(found.y_m), len(found.x_m))
    assert np.isnan(found.value).any()
    assert np.abs(found.x_m).max() < 0.5
    assert np.abs(found.y_m).max() < 0.26
    place = tilted.pushes.paths[0, 3, 0, :2]
    row, column = np.argmin(np.abs(found.y_m - place[1])), np.argmin(np.abs(found.x_m - place[0]))
    assert np.isfinite(found.value[row, column])


def test_nothing_is_left_of_what_was_explained(tilted: Space) -> None:
    before = residual_map(tilted)
    noise = np.random.default_rng(0).normal(size=tilted.fit.linear.residual.shape)
    after = residual_map(tilted, noise)
    assert before is not None
    assert after is not None
    assert np.nanmax(after.value) < 0.2 * np.nanmax(before.value)


def test_a_local_push_shows_where_it_is() -> None:
    centre, radius = planned_space().pushes.paths[0, 7, 0, :2], 0.08
    space = space_of(recorded(Attached(EFFECTS["fan_field"], PUCKS), [0.03, *centre, radius, 0.0]))
    found = residual_map(space)
    assert found is not None
    x, y = np.meshgrid(found.x_m, found.y_m)
    near = np.hypot(x - centre[0], y - centre[1]) < 2 * radius
    seen = np.isfinite(found.value)
    assert (near & seen).sum() >= 2, found
    assert np.median(found.value[near & seen]) > 3 * np.median(found.value[~near & seen])

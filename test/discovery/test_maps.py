"""Accelerations that are lacking, found again where they were planted."""

from __future__ import annotations

import numpy as np
import pytest

from compass_ros.discovery.discrepancy import free
from compass_ros.discovery.maps import table_map
from compass_ros.discovery.response import Response
from compass_ros.discovery.where import whereabouts
from compass_ros.simulation.effects import EFFECTS, Attached
from test.discovery.planted import PUCKS, planned_response, recorded, response_of


@pytest.fixture(scope="module")
def tilted() -> Response:
    return response_of(recorded(Attached(EFFECTS["table_tilt"], PUCKS), [0.0, 0.002]))


def test_a_tilt_is_the_same_push_everywhere(tilted: Response) -> None:
    """0.002 of the weight, 0.02 m/s^2 along y, on pucks that move; less by what the parameters take of it."""
    push = free(tilted).pushes[:, :, :4].reshape(*tilted.states.shape[:3], 2)
    moving = np.linalg.norm(tilted.states[..., 2:4], axis=3) > 0.05
    assert moving.sum() > 40
    assert np.median(push[moving][:, 1]) == pytest.approx(0.0196, rel=0.5)
    assert abs(np.median(push[moving][:, 0])) < 0.006


def test_the_map_is_nan_where_nothing_passed_and_lies_on_the_table(tilted: Response) -> None:
    found = table_map(tilted, free(tilted).pushes)
    assert found is not None
    assert found.value.shape == (len(found.y_m), len(found.x_m))
    assert np.isnan(found.value).any()
    assert np.abs(found.x_m).max() < 0.5
    assert np.abs(found.y_m).max() < 0.26
    place = tilted.states[0, 6, 0, :2]
    row, column = np.argmin(np.abs(found.y_m - place[1])), np.argmin(np.abs(found.x_m - place[0]))
    assert np.isfinite(found.value[row, column])


def test_a_local_push_shows_where_it_is() -> None:
    centre, radius = planned_response().states[0, 14, 0, :2], 0.08
    response = response_of(recorded(Attached(EFFECTS["fan_field"], PUCKS), [0.03, *centre, radius, 0.0]))
    discrepancy = free(response)
    found = table_map(response, discrepancy.pushes)
    assert found is not None
    x, y = np.meshgrid(found.x_m, found.y_m)
    near = np.hypot(x - centre[0], y - centre[1]) < 2 * radius
    seen = np.isfinite(found.value)
    assert (near & seen).sum() >= 2, found
    assert np.median(found.value[near & seen]) > 2.5 * np.median(found.value[~near & seen])


def test_an_attraction_is_said_to_depend_on_place() -> None:
    """Of a field that pushes one way in a disc three shots cannot say so: forces of time are as good."""
    centre = planned_response().states[0, 14, 0, :2]
    response = response_of(recorded(Attached(EFFECTS["point_attraction"], PUCKS), [0.05, *centre, 0.1]))
    assert whereabouts(response, free(response)).depends_on == "place"

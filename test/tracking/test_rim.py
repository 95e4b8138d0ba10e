"""Measured centres against drawn ones: perspective, blur, hidden parts, neighbours, shadows."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from compass_ros.tracking.blobs import find_blobs, hue_image
from compass_ros.tracking.camera import TableView
from compass_ros.tracking.config import ObjectConfig, TrackerConfig
from compass_ros.tracking.rim import RimFit, fit_rims
from compass_ros.tracking.virtual_camera import VirtualCamera, draw, render
from compass_ros.types import Floats
from test.tracking.conftest import held

PUCK = TrackerConfig().objects["puck1"]
GRID = [(x, y) for x in (-0.4, -0.13, 0.21, 0.41) for y in (-0.19, 0.017, 0.18)]


def measure(view: TableView, image: NDArray[np.uint8], at: tuple[float, float], look: ObjectConfig = PUCK) -> RimFit:
    """The fit from a seed 4 mm off."""
    return fit_rims(image, view, np.array([at]) + 0.003 * np.array([[1, -1]]), [look])


@pytest.mark.parametrize("at", GRID)
def test_centre_of_a_resting_puck(quiet: VirtualCamera, view: TableView, at: tuple[float, float]) -> None:
    fit = measure(view, draw(quiet, {"puck1": held(*at)}), at)
    assert np.linalg.norm(fit.xy[0] - at) < 0.0004
    assert fit.arc[0] > 0.9


def test_the_spot_in_the_image_is_biased_and_the_rim_is_not(quiet: VirtualCamera, view: TableView) -> None:
    # the side that the camera sees, the top's height and perspective pull the spot's centroid towards the camera
    spot, rim = [], []
    for at in GRID:
        image = draw(quiet, {"puck1": held(*at)})
        (blob,) = find_blobs(hue_image(image), view, PUCK)
        outwards = np.array(at) / np.linalg.norm(at)
        spot.append((blob.xy - at) @ outwards)
        rim.append((measure(view, image, at).xy[0] - at) @ outwards)
    assert np.mean(spot) < -0.0003
    assert abs(np.mean(rim)) < 0.0002


@pytest.mark.parametrize("velocity", [(1.2, 0.0), (-0.7, 0.7), (0.0, -1.5)])
def test_a_blurred_puck_is_where_it_was_at_mid_exposure(
    quiet: VirtualCamera, view: TableView, velocity: tuple[float, float]
) -> None:
    at = (0.2, -0.1)
    still = measure(view, draw(quiet, {"puck1": held(*at)}), at).xy[0]
    moving = measure(view, draw(quiet, {"puck1": held(*at, *velocity)}), at).xy[0]
    # the blur is up to 6 mm long; a stamp at either end of the exposure would be 3 mm off
    assert np.linalg.norm(moving - still) < 0.0002


@pytest.mark.parametrize("angle", [0.0, 1.6, 3.5])
def test_half_a_puck_is_enough_and_says_so(quiet: VirtualCamera, view: TableView, angle: float) -> None:
    at = np.array([-0.1, 0.05])
    image = draw(quiet, {"puck1": held(*at)})
    whole = measure(view, image, (at[0], at[1]))
    grid = np.stack(np.meshgrid(np.arange(640), np.arange(480)), axis=-1).reshape(-1, 2).astype(float)
    beyond = (view.table_from_pixel(grid) - at) @ [np.cos(angle), np.sin(angle)] > 0.003
    image[beyond.reshape(480, 640)] = (90, 95, 100)
    fit = measure(view, image, (at[0], at[1]))
    assert np.linalg.norm(fit.xy[0] - at) < 0.0010
    assert 0.3 < fit.arc[0] < 0.65
    assert np.trace(fit.covariance[0]) > 1.5 * np.trace(whole.covariance[0])


@pytest.mark.parametrize("other", ["puck1", "puck2"])
def test_a_touching_neighbour_does_not_pull(quiet: VirtualCamera, view: TableView, other: str) -> None:
    at, beside = np.array([0.05, 0.1]), np.array([0.05 + 0.0511 * 0.8, 0.1 - 0.0511 * 0.6])
    alone = draw(quiet, {"puck1": held(*at)})
    image = draw(quiet, {"puck1": held(*at), "puck2": held(*beside)})
    if other == "puck1":  # the neighbour in the same colour
        paint = draw(quiet, {"puck1": held(*beside)})
        image = np.where((paint != draw(quiet, {})).any(axis=2, keepdims=True), paint, alone)
    assert np.linalg.norm(measure(view, image, (at[0], at[1])).xy[0] - at) < 0.0006


def test_a_shadow_across_the_puck_does_not_pull(quiet: VirtualCamera, view: TableView) -> None:
    at = (-0.2, 0.02)
    image = draw(quiet, {"puck1": held(*at)}).astype(np.float64)
    u, _ = view.pixel_from_table(np.array([*at, 0.0]))
    edge = np.clip((np.arange(640) - u) / 6 + 0.5, 0, 1)
    shaded = (image * (1 - 0.3 * edge)[None, :, None]).astype(np.uint8)
    assert np.linalg.norm(measure(view, shaded, at).xy[0] - at) < 0.0006


def test_nothing_there_is_not_a_puck(quiet: VirtualCamera, view: TableView) -> None:
    fit = measure(view, draw(quiet, {}), (0.2, 0.1))
    assert fit.arc[0] == 0
    assert fit.covariance[0].max() > 0.01


def test_stated_covariance_covers_the_noise(camera: VirtualCamera, view: TableView) -> None:
    at = (0.2, 0.1)
    found: list[Floats] = []
    for number in range(12):
        fit = measure(view, render(camera, {"puck1": held(*at)}, number), at)
        found.append(fit.xy[0])
    scatter = np.std(found, axis=0).max()
    assert scatter < 2 * np.sqrt(fit.covariance[0].max())
    assert scatter < 0.0001

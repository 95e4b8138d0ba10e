"""The drawn images against geometry that the drawing does not use."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import binary_erosion, binary_fill_holes, center_of_mass

from compass_ros.tracking.camera import TableView
from compass_ros.tracking.scene_config import DiscConfig
from compass_ros.tracking.virtual_camera import VirtualCamera, draw, expose, exposure_times, make_camera, render
from compass_ros.types import Floats
from test.tracking.conftest import held

FLAT = DiscConfig(colour=(0, 0, 0), radius_m=0.0255, height_m=0.0, shadow=0.0)


def cover(quiet: VirtualCamera, pose: Floats) -> Floats:
    """(H, W) how much a flat disc darkens each pixel."""
    camera = replace(quiet, config=replace(quiet.config, discs={"disc": FLAT}))
    before, after = (draw(camera, poses).astype(float).sum(axis=2) for poses in ({}, {"disc": pose}))
    return np.asarray((before - after) / before)


@pytest.mark.parametrize("at", [(0.02, 0.15), (-0.4, -0.19), (0.4137, 0.1891)])
def test_a_flat_disc_is_seen_where_the_lens_puts_it(
    quiet: VirtualCamera, view: TableView, at: tuple[float, float]
) -> None:
    angles = np.linspace(0, 2 * np.pi, 721)[:-1]
    rings = [
        (np.array(at) + r * 0.0255 * np.stack([np.cos(angles), np.sin(angles)], -1), r)
        for r in np.linspace(0.05, 1, 20)
    ]
    points = np.concatenate([ring for ring, _ in rings])
    weights = np.concatenate([np.full(len(ring), r) for ring, r in rings])
    pixels = view.pixel_from_table(np.column_stack([points, np.zeros(len(points))]))
    share = cover(quiet, held(*at))
    # the light spot that shows the yaw belongs to the disc
    share = np.where(
        binary_fill_holes(share > 0.5), np.maximum(share, binary_erosion(binary_fill_holes(share > 0.5))), share
    )
    row, column = center_of_mass(share)
    assert np.linalg.norm(np.average(pixels, axis=0, weights=weights) - [column, row]) < 0.03
    outline = pixels[-720:]
    shoelace = np.sum(outline[:, 0] * np.roll(outline[:, 1], 1) - outline[:, 1] * np.roll(outline[:, 0], 1))
    assert share.sum() == pytest.approx(abs(shoelace) / 2, rel=0.005)


def test_a_blurred_image_is_the_mean_of_sharp_ones(quiet: VirtualCamera) -> None:
    moving = held(0.2, 0.1, 1.5, 0.8)
    blurred = draw(quiet, {"puck2": moving}).astype(float)
    sharp = np.mean([draw(quiet, {"puck2": np.repeat(pose[None], 5, axis=0)}) for pose in moving], axis=0)
    still = draw(quiet, {"puck2": held(0.2, 0.1)}).astype(float)
    assert np.abs(blurred - still).max() > 60
    # the soft shadow alone is drawn at mid-exposure
    assert np.abs(blurred - sharp).max() < 14
    assert np.abs(blurred - sharp).mean() < 0.02


def test_moments_of_the_exposure_are_symmetric_about_the_image_time(quiet: VirtualCamera) -> None:
    times = exposure_times(quiet.config.camera, np.array([0.5, 1.0]))
    assert times.shape == (2, 5)
    np.testing.assert_allclose(times.mean(axis=1), [0.5, 1.0])
    assert np.ptp(times[0]) < quiet.config.camera.exposure_s


def test_noise_is_that_of_the_configuration_and_repeatable(camera: VirtualCamera) -> None:
    drawn = draw(camera, {})
    taken = np.stack([expose(camera, drawn, number).astype(float) for number in range(8)])
    middle = (drawn > 30) & (drawn < 225)
    assert (taken - drawn)[:, middle].std() == pytest.approx(2.5, abs=0.1)
    correlation = np.corrcoef((taken[0] - drawn)[middle], (taken[1] - drawn)[middle])[0, 1]
    assert abs(correlation) < 0.01
    poses = {"puck1": held(0, 0)}
    np.testing.assert_array_equal(render(camera, poses, 3), render(camera, poses, 3))
    assert (render(camera, poses, 3) != render(camera, poses, 4)).any()


def test_light_is_uneven(quiet: VirtualCamera) -> None:
    light = quiet.scene.light
    assert light.max() == pytest.approx(1.0)
    assert light.min() == pytest.approx(1 - quiet.config.light)


def test_the_arm_hides_what_is_under_it(camera: VirtualCamera, quiet: VirtualCamera) -> None:
    poses = {"pusher": held(-0.2, 0.07), "puck1": held(-0.32, -0.05)}

    def red(image: NDArray[np.uint8]) -> int:
        return int(((image[..., 2] > 120) & (image[..., 1] < 80)).sum())

    assert red(draw(quiet, poses)) > 500
    assert red(draw(camera, poses)) < 0.6 * red(draw(quiet, poses))


def test_the_table_can_stand_shifted_against_the_fiducials(quiet: VirtualCamera, view: TableView) -> None:
    shifted = make_camera(quiet.config, 0, (0.03, -0.02))
    images = [draw(camera, {}).astype(float).mean(axis=2) for camera in (quiet, shifted)]
    box = np.array([0.1, 0.0, 0.015])
    for image, shift in zip(images, ([0, 0, 0], [0.03, -0.02, 0]), strict=True):
        u, v = view.pixel_from_table(box + shift).round().astype(int)
        assert image[v - 2 : v + 3, u - 1 : u + 2].max() < 80, "the obstacle is dark"
    marker = view.pixel_from_table(np.array([-0.44, 0.31, 0])).astype(int)
    patch = np.s_[marker[1] - 20 : marker[1] + 20, marker[0] - 20 : marker[0] + 20]
    np.testing.assert_array_equal(images[0][patch], images[1][patch])


def test_a_disc_outside_of_the_picture_draws_nothing(quiet: VirtualCamera) -> None:
    np.testing.assert_array_equal(draw(quiet, {"puck1": held(2.0, 1.5)}), quiet.scene.background)

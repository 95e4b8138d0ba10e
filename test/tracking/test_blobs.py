"""The coarse search by colour."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest

from compass_ros.tracking.blobs import colour_mask, find_blobs, hue_image
from compass_ros.tracking.camera import TableView
from compass_ros.tracking.config import ObjectConfig, TrackerConfig
from compass_ros.tracking.virtual_camera import VirtualCamera, draw
from test.tracking.conftest import held


@pytest.mark.parametrize("hue", [0.0, 5.0, 120.0, 240.0, 352.0, 360.0])
def test_mask_takes_the_hues_within_the_tolerance_around_the_circle(hue: float) -> None:
    look = ObjectConfig(hue_deg=hue, hue_tolerance_deg=20.0)
    degrees = np.arange(0, 360, 2)
    hsv = np.stack([degrees // 2, np.full(180, 200), np.full(180, 200)], axis=-1)[None].astype(np.uint8)
    away = np.abs((degrees - hue + 180) % 360 - 180)
    taken = colour_mask(hsv, look)[0] > 0
    assert taken[away <= 18].all()
    assert not taken[away >= 22].any()


def test_pale_and_dark_pixels_have_no_colour() -> None:
    hsv = np.array([[[60, 40, 200], [60, 200, 10], [60, 200, 200]]], np.uint8)
    assert (colour_mask(hsv, ObjectConfig(hue_deg=120)) > 0).tolist() == [[False, False, True]]


def test_each_disc_is_found_and_nothing_else(camera: VirtualCamera, view: TableView, config: TrackerConfig) -> None:
    places = {"puck1": (-0.1, -0.12), "puck2": (0.3, 0.1), "pusher": (-0.2, 0.07)}
    hsv = hue_image(draw(camera, {name: held(*at) for name, at in places.items()}))
    for name, at in places.items():
        blobs = find_blobs(hsv, view, config.objects[name])
        assert len(blobs) == 1
        assert np.linalg.norm(blobs[0].xy - at) < 0.006


def test_a_disc_hidden_in_part_is_guessed_near_its_centre(
    quiet: VirtualCamera, view: TableView, config: TrackerConfig
) -> None:
    at = np.array([0.25, 0.05])
    image = draw(quiet, {"puck2": held(*at)})
    u, v = view.pixel_from_table(np.array([*at, 0.0])).round().astype(int)
    cv2.rectangle(image, (u + 2, v - 40), (u + 60, v + 40), (90, 90, 90), -1)
    (blob,) = find_blobs(hue_image(image), view, config.objects["puck2"])
    assert blob.share < 0.75
    assert np.linalg.norm(blob.xy - at) < 0.007, "the fine measurement takes a seed within a third of the radius"


def test_nothing_of_the_colour(quiet: VirtualCamera, view: TableView, config: TrackerConfig) -> None:
    assert find_blobs(hue_image(draw(quiet, {})), view, config.objects["puck1"]) == ()
    huge = replace(config.objects["puck1"], radius_m=0.006)
    image = draw(quiet, {"puck1": held(0, 0)})
    assert find_blobs(hue_image(image), view, huge) == (), "far larger than the disc"

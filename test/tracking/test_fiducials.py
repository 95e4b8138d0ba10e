"""The camera's place from the markers: a planted one is recovered; hidden, wrong and moved markers are noticed."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from compass_ros.errors import ConfigError
from compass_ros.tracking.camera import TableView
from compass_ros.tracking.config import FiducialConfig
from compass_ros.tracking.fiducials import TableFix, detect_markers, marker_corners, recheck, update_fix
from compass_ros.tracking.virtual_camera import VirtualCamera, render

CONFIG = FiducialConfig()
TABLE = np.array([[x, y] for x in (-0.4, 0.0, 0.4) for y in (-0.2, 0.0, 0.2)])


def gray(camera: VirtualCamera, number: int = 0) -> NDArray[np.uint8]:
    return np.asarray(cv2.cvtColor(render(camera, {}, number), cv2.COLOR_BGR2GRAY), dtype=np.uint8)


def table_error(found: TableView | None, true: TableView) -> float:
    """Largest distance between where the two put the same pixels on the table [m]."""
    assert found is not None
    pixels = true.pixel_from_table(np.column_stack([TABLE, np.zeros(len(TABLE))]))
    return float(np.linalg.norm(found.table_from_pixel(pixels) - TABLE, axis=1).max())


def test_the_planted_place_is_recovered_and_improves_with_images(camera: VirtualCamera, view: TableView) -> None:
    fix = TableFix()
    for number in range(5):
        fix = update_fix(fix, gray(camera, number), view.camera, CONFIG)
    assert fix.problem == ""
    assert fix.residual_px < 0.4
    assert table_error(fix.view, view) < 0.0005
    assert {corner.images for corner in fix.corners.values()} == {5}


def test_corners_are_where_the_scene_puts_them(quiet: VirtualCamera, view: TableView) -> None:
    found = detect_markers(gray(quiet), CONFIG)
    assert set(found) == set(CONFIG.ids)
    for number, corners in found.items():
        assert np.abs(corners - view.pixel_from_table(marker_corners(CONFIG, number))).max() < 0.4


def test_no_fiducials_is_one_clear_line(view: TableView) -> None:
    fix = update_fix(TableFix(), np.full((480, 640), 128, np.uint8), view.camera, CONFIG)
    assert fix.view is None
    assert fix.problem == "no fiducials in view: 0 of the markers [0, 1, 2, 3] (DICT_4X4_50) seen, 3 needed"


def test_markers_that_lie_elsewhere_are_noticed(camera: VirtualCamera, view: TableView) -> None:
    wrong = replace(CONFIG, x_m=(-0.44, 0.40, 0.44, -0.48))
    fix = update_fix(TableFix(), gray(camera), view.camera, wrong)
    assert fix.view is None
    assert "do not lie where configured" in fix.problem


def test_a_half_hidden_marker_is_left_out(camera: VirtualCamera, view: TableView) -> None:
    image = gray(camera)
    good = update_fix(TableFix(), image, view.camera, CONFIG)
    shifted = {n: replace(c, pixel=c.pixel + (n == 2) * np.array([4.0, -3.0])) for n, c in good.corners.items()}
    fix = update_fix(TableFix(shifted), image, view.camera, CONFIG)
    assert table_error(fix.view, view) < 0.0008
    # with a known view, one marker that jumps changes nothing
    corner = view.pixel_from_table(marker_corners(CONFIG, 1)).astype(int)[0]
    hidden = image.copy()
    hidden[corner[1] - 12 : corner[1] + 5, corner[0] - 12 : corner[0] + 5] = 0
    assert table_error(recheck(good, hidden, 1, view.camera, CONFIG).view, view) < 0.0008


def test_a_view_outlives_hidden_markers(camera: VirtualCamera, view: TableView) -> None:
    fix = update_fix(TableFix(), gray(camera), view.camera, CONFIG)
    dark = np.zeros((480, 640), np.uint8)
    assert recheck(fix, dark, 0, view.camera, CONFIG) is fix
    assert update_fix(fix, dark, view.camera, CONFIG).view is not None


def test_a_moved_camera_is_noticed_by_one_recheck(camera: VirtualCamera, view: TableView) -> None:
    image = gray(camera)
    fix = update_fix(TableFix(), image, view.camera, CONFIG)
    moved = np.roll(image, (5, -7), axis=(0, 1))
    after = recheck(fix, moved, 2, view.camera, CONFIG)
    assert fix.view is not None
    assert after.view is not None
    shift = after.view.pixel_from_table(np.zeros(3)) - fix.view.pixel_from_table(np.zeros(3))
    np.testing.assert_allclose(shift, [-7, 5], atol=0.5)


def test_unknown_dictionary(view: TableView) -> None:
    with pytest.raises(ConfigError, match="did you mean 'DICT_4X4_50'"):
        detect_markers(np.zeros((480, 640), np.uint8), replace(CONFIG, dictionary="DICT_4x4_50"))

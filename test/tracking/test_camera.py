"""The camera model against OpenCV's own projection, and its inverse against itself."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml

from compass_ros.errors import TrackingError
from compass_ros.tracking.camera import CameraModel, TableView, camera_model, read_camera

DISTORTIONS = [(), (-0.085, 0.055, 0.0007, -0.0005, 0.0), (0.12, -0.2, 0.001, 0.002, 0.05, 0.03, -0.02, 0.01)]


def looking_down(coefficients: tuple[float, ...]) -> TableView:
    camera = CameraModel(640, 480, (615.3, 612.0), (322.4, 238.1), coefficients)
    rotation = cv2.Rodrigues(np.array([np.pi - 0.08, 0.03, 0.05]))[0]
    return TableView(camera, np.asarray(rotation, dtype=np.float64), np.array([0.02, -0.01, 1.02]))


@pytest.mark.parametrize("coefficients", DISTORTIONS)
def test_projection_is_that_of_opencv(coefficients: tuple[float, ...]) -> None:
    view = looking_down(coefficients)
    points = np.random.default_rng(1).uniform([-0.45, -0.3, 0], [0.45, 0.3, 0.1], (200, 3))
    expected, _ = cv2.projectPoints(
        points, cv2.Rodrigues(view.rotation)[0], view.translation, view.camera.matrix, view.camera.distortion
    )
    np.testing.assert_allclose(view.pixel_from_table(points), expected[:, 0], atol=1e-9)


@pytest.mark.parametrize("coefficients", DISTORTIONS)
@pytest.mark.parametrize("height", [0.0, 0.006, 0.1])
def test_table_from_pixel_undoes_the_projection(coefficients: tuple[float, ...], height: float) -> None:
    view = looking_down(coefficients)
    xy = np.random.default_rng(2).uniform([-0.45, -0.3], [0.45, 0.3], (200, 2))
    pixels = view.pixel_from_table(np.column_stack([xy, np.full(200, height)]))
    np.testing.assert_allclose(view.table_from_pixel(pixels, height), xy, atol=1e-7)


def test_no_pixels_give_no_points() -> None:
    assert looking_down(()).table_from_pixel(np.zeros((0, 2))).shape == (0, 2)


def test_camera_position_and_scale() -> None:
    view = looking_down(())
    np.testing.assert_allclose(view.rotation @ view.position + view.translation, 0, atol=1e-12)
    # pinhole: depth over focal length, give or take the tilt
    assert view.metres_per_pixel == pytest.approx(1.02 / 614, rel=0.01)


def test_equal_cameras_are_equal() -> None:
    assert looking_down(DISTORTIONS[1]).camera == looking_down(DISTORTIONS[1]).camera
    assert looking_down(DISTORTIONS[1]).camera != looking_down(()).camera


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"matrix": [0.0] * 9}, "not calibrated"),
        ({"distortion_model": "fisheye"}, "'fisheye' is not known; known are"),
        ({"distortion": [0.1] * 6}, r"'plumb_bob' has at most 5 coefficients, found 6 with"),
        ({"distortion": [0.1, float("nan")]}, r"at most 5 coefficients, found 2 with .*nan"),
        ({"distortion": [0.1] * 5, "distortion_model": ""}, r"'' has at most 0 coefficients, found 5"),
        ({"size": (0, 480)}, "found 0x480"),
    ],
)
def test_bad_camera_info_gets_one_line(changes: dict[str, object], message: str) -> None:
    good: dict[str, object] = {
        "size": (640, 480), "matrix": [600, 0, 320, 0, 600, 240, 0, 0, 1], "distortion_model": "plumb_bob",
        "distortion": [0.0] * 5, "where": "camera_info",
    }  # fmt: skip
    with pytest.raises(TrackingError, match=message) as caught:
        camera_model(**(good | changes))  # type: ignore[arg-type]
    assert str(caught.value).startswith("camera_info: ")


@pytest.mark.parametrize(
    ("model", "given", "needed"),
    [
        ("plumb_bob", [-0.03, 0.035, -1e-4, -1e-4, -0.012, 0, 0, 0], [-0.03, 0.035, -1e-4, -1e-4, -0.012]),
        ("plumb_bob", [0.1, -0.2], [0.1, -0.2, 0, 0]),
        ("plumb_bob", [0.1], [0.1, 0, 0, 0]),
        ("plumb_bob", [0.0] * 14, []),
        ("plumb_bob", [0.1, 0, 0, 0, 0.2], [0.1, 0, 0, 0, 0.2]),
        ("rational_polynomial", [0.1, -0.2, 0, 0, 0.3], [0.1, -0.2, 0, 0, 0.3, 0, 0, 0]),
        ("rational_polynomial", [0.1] * 8 + [0] * 6, [0.1] * 8),
        ("rational_polynomial", [], [0] * 8),
        ("", [0.0] * 5, []),
    ],
)
def test_zeros_at_the_end_of_the_distortion_mean_nothing(model: str, given: list[float], needed: list[float]) -> None:
    matrix = [600.0, 0, 320, 0, 600, 240, 0, 0, 1]
    assert camera_model((640, 480), matrix, model, given, "x").coefficients == tuple(needed)


def test_calibration_file(tmp_path: Path) -> None:
    path = tmp_path / "camera.yaml"
    content = {
        "image_width": 640, "image_height": 480, "distortion_model": "plumb_bob",
        "camera_matrix": {"rows": 3, "cols": 3, "data": [615.3, 0, 322.4, 0, 612.0, 238.1, 0, 0, 1]},
        "distortion_coefficients": {"rows": 1, "cols": 5, "data": list(DISTORTIONS[1])},
    }  # fmt: skip
    path.write_text(yaml.safe_dump(content))
    assert read_camera(path) == looking_down(DISTORTIONS[1]).camera
    path.write_text(yaml.safe_dump(content | {"camera_matrix": 3}))
    with pytest.raises(TrackingError, match="camera_matrix"):
        read_camera(path)

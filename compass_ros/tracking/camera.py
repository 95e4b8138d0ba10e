"""Pinhole camera with lens distortion, and its pose over the table.

Pixels are (u, v), u to the right, v down, with (0, 0) the centre of the first pixel. The distortion is OpenCV's
(and ROS's) `plumb_bob` (k1 k2 p1 p2 k3) or `rational_polynomial` (k1 k2 p1 p2 k3 k4 k5 k6); numbers left out are zero.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import cv2
import numpy as np

from compass_ros.config import read_yaml
from compass_ros.errors import TrackingError, shown
from compass_ros.types import Floats

_DISTORTION_SIZES = {"": (0,), "plumb_bob": (0, 4, 5), "rational_polynomial": (8,)}
"""Numbers that OpenCV takes for each model."""
_UNDISTORT = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 40, 1e-10)


@dataclass(frozen=True)
class CameraModel:
    """Intrinsics of a camera."""

    width: int
    height: int
    focal: tuple[float, float]
    """fx, fy [px]."""
    centre: tuple[float, float]
    """cx, cy [px]."""
    coefficients: tuple[float, ...] = ()
    """0, 4, 5 or 8 of the distortion, in OpenCV's order."""

    @cached_property
    def matrix(self) -> Floats:
        """(3, 3) [[fx, 0, cx], [0, fy, cy], [0, 0, 1]] in pixels."""
        return np.array([[self.focal[0], 0, self.centre[0]], [0, self.focal[1], self.centre[1]], [0, 0, 1]])

    @cached_property
    def distortion(self) -> Floats:
        """(D,) the coefficients."""
        return np.array(self.coefficients)

    def pixel_from_normalised(self, points: Floats) -> Floats:
        """Ideal image coordinates x/z, y/z (..., 2) -> distorted pixels (..., 2)."""
        k = np.zeros(8)
        k[: self.distortion.size] = self.distortion
        x, y = points[..., 0], points[..., 1]
        r2 = x * x + y * y
        radial = 1 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]))
        if np.any(k[5:]):
            radial = radial / (1 + r2 * (k[5] + r2 * (k[6] + r2 * k[7])))
        u = x * radial + 2 * k[2] * x * y + k[3] * (r2 + 2 * x * x)
        v = y * radial + k[2] * (r2 + 2 * y * y) + 2 * k[3] * x * y
        return np.stack([self.matrix[0, 0] * u + self.matrix[0, 2], self.matrix[1, 1] * v + self.matrix[1, 2]], axis=-1)

    def normalised_from_pixel(self, pixels: Floats) -> Floats:
        """Distorted pixels (N, 2) -> ideal image coordinates (N, 2). The inverse of `pixel_from_normalised`."""
        if len(pixels) == 0:
            return np.zeros((0, 2))
        flat = np.ascontiguousarray(pixels, dtype=np.float64).reshape(-1, 1, 2)
        eye = np.eye(3)
        ideal = cv2.undistortPointsIter(flat, self.matrix, self.distortion, eye, eye, _UNDISTORT)
        return np.asarray(ideal, dtype=np.float64).reshape(-1, 2)


@dataclass(frozen=True)
class TableView:
    """A camera in its place over the table."""

    camera: CameraModel
    rotation: Floats
    """(3, 3) camera_from_table: optical axes (x right, y down, z forward) of a direction in the frame `table`."""
    translation: Floats
    """(3,) the table's origin in the camera's optical frame [m]."""

    @property
    def position(self) -> Floats:
        """(3,) the camera's centre in the frame `table` [m]."""
        return np.asarray(-self.rotation.T @ self.translation)

    def pixel_from_table(self, points: Floats) -> Floats:
        """Points (..., 3) in the frame `table` [m] -> pixels (..., 2). The points must lie in front of the camera."""
        seen = points @ self.rotation.T + self.translation
        return self.camera.pixel_from_normalised(seen[..., :2] / seen[..., 2:])

    def table_from_pixel(self, pixels: Floats, height_m: float = 0.0) -> Floats:
        """Pixels (N, 2) -> where their rays meet the plane z = `height_m` over the table, (N, 2) x and y [m]."""
        ideal = self.camera.normalised_from_pixel(pixels)
        rays = np.column_stack([ideal, np.ones(len(ideal))]) @ self.rotation
        eye = self.position
        return np.asarray(eye[:2] + rays[:, :2] * ((height_m - eye[2]) / rays[:, 2:]))

    @cached_property
    def metres_per_pixel(self) -> float:
        """Length on the table's surface that one pixel covers around the table's origin."""
        step = 1e-3
        moved = self.pixel_from_table(np.array([[0.0, 0, 0], [step, 0, 0], [0, step, 0]]))
        jacobian = (moved[1:] - moved[0]) / step
        return float(1 / np.sqrt(abs(np.linalg.det(jacobian))))


def camera_model(
    size: tuple[int, int], matrix: Sequence[float], distortion_model: str, distortion: Sequence[float], where: str
) -> CameraModel:
    """Check the fields of a camera_info: `size` is width and height, `matrix` 9 numbers row by row.

    Raises TrackingError naming `where`.
    """
    k = np.asarray(matrix, dtype=np.float64).reshape(-1)
    if k.size != 9 or not np.all(np.isfinite(k)) or k[0] <= 0 or k[4] <= 0:
        raise TrackingError(f"{where}: not calibrated: expected the 9 numbers of K with fx, fy > 0, found {k.tolist()}")
    if distortion_model not in _DISTORTION_SIZES:
        known = sorted(name for name in _DISTORTION_SIZES if name)
        raise TrackingError(f"{where}: distortion model '{distortion_model}' is not known; known are {known}")
    d = _coefficients(np.asarray(distortion, dtype=np.float64).reshape(-1), distortion_model, where)
    width, height = size
    if width <= 0 or height <= 0:
        raise TrackingError(f"{where}: image size must be positive, found {width}x{height}")
    return CameraModel(width, height, (float(k[0]), float(k[4])), (float(k[2]), float(k[5])), d)


def _coefficients(given: Floats, model: str, where: str) -> tuple[float, ...]:
    """As many numbers as OpenCV takes: zeros at the end mean the same as none, however many a driver sends."""
    sizes = _DISTORTION_SIZES[model]
    needed = int(np.flatnonzero(given)[-1]) + 1 if given.any() else 0
    if not np.all(np.isfinite(given)) or needed > sizes[-1]:
        found = f"{given.size} with the last that is not zero at place {needed}: {given.tolist()}"
        raise TrackingError(f"{where}: distortion model '{model}' has at most {sizes[-1]} coefficients, found {found}")
    size = given.size if given.size in sizes else next(size for size in sizes if size >= needed)
    return tuple(np.pad(given[:size], (0, max(size - given.size, 0))).tolist())


def read_camera(path: Path) -> CameraModel:
    """Camera from a calibration YAML as ROS's camera_calibration writes it. Raises ConfigError or TrackingError."""
    content = read_yaml(path)
    data: dict[str, list[float]] = {}
    for name in ("camera_matrix", "distortion_coefficients"):
        entry = content.get(name)
        if not isinstance(entry, Mapping) or not isinstance(entry.get("data"), list):
            raise TrackingError(f"{path}: expected '{name}: {{data: [...]}}', found {shown(entry)}")
        data[name] = entry["data"]
    size = [content.get("image_width"), content.get("image_height")]
    if not all(isinstance(number, int) for number in size):
        raise TrackingError(f"{path}: expected integers image_width and image_height, found {shown(size)}")
    model = str(content.get("distortion_model", "plumb_bob"))
    width, height = (int(str(number)) for number in size)
    return camera_model((width, height), data["camera_matrix"], model, data["distortion_coefficients"], str(path))

"""Where the camera stands: ArUco markers around the table -> `TableView`.

The camera and the table stand still, so the corners are averaged over the images in which they were seen.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from compass_ros.errors import ConfigError, nearest
from compass_ros.tracking.camera import CameraModel, TableView
from compass_ros.tracking.config import FiducialConfig
from compass_ros.types import Floats

_AVERAGED = 40
"""Images over which a corner is averaged."""
_MOVED_PX = 1.5
"""Markers that jump by more: the camera has moved."""


@dataclass(frozen=True)
class Corners:
    """Mean corners of one marker."""

    pixel: Floats
    """(4, 2) in the order top left, top right, bottom right, bottom left of the print."""
    images: int


@dataclass(frozen=True)
class TableFix:
    """What is known about the camera's place. `view` is None until enough markers were seen."""

    corners: Mapping[int, Corners] = field(default_factory=dict)
    view: TableView | None = None
    residual_px: float = float("nan")
    """Root mean square reprojection error of the corners."""
    problem: str = "no image yet"
    """One line; empty when all is well."""


@lru_cache(maxsize=8)
def _detector(dictionary: str) -> cv2.aruco.ArucoDetector:
    names = [name for name in dir(cv2.aruco) if name.startswith("DICT_")]
    if dictionary not in names:
        hint = nearest(dictionary, names)
        raise ConfigError(f"fiducials.dictionary: '{dictionary}' is not an ArUco dictionary{hint}")
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    parameters.cornerRefinementWinSize = 4
    return cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, dictionary)), parameters)


def detect_markers(gray: NDArray[np.uint8], config: FiducialConfig) -> dict[int, Floats]:
    """Markers of the configuration in a grey image: id -> (4, 2) corners in pixels."""
    corners, ids, _ = _detector(config.dictionary).detectMarkers(gray)
    # without a marker, ids is None
    numbers = np.asarray(ids).reshape(-1).tolist() if len(corners) else []
    found = zip(numbers, corners, strict=True)
    return {number: np.asarray(c, dtype=np.float64).reshape(4, 2) for number, c in found if number in config.ids}


def marker_corners(config: FiducialConfig, number: int) -> Floats:
    """(4, 3) corners of a marker in the frame `table` [m], in the order of `detect_markers`."""
    index = config.ids.index(number)
    half = config.side_m / 2
    centre = np.array([config.x_m[index], config.y_m[index], 0.0])
    return np.asarray(centre + half * np.array([[-1, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]]))


def update_fix(fix: TableFix, gray: NDArray[np.uint8], camera: CameraModel, config: FiducialConfig) -> TableFix:
    """Look for all markers in an image and improve the fix. A view once found is kept when markers are hidden."""
    return _merge(fix, detect_markers(gray, config), camera, config)


def recheck(
    fix: TableFix, gray: NDArray[np.uint8], number: int, camera: CameraModel, config: FiducialConfig
) -> TableFix:
    """Look for one known marker where it was last: cheap, improves the mean, notices a moved camera."""
    known = fix.corners[number].pixel
    margin = 0.6 * float(np.ptp(known, axis=0).max())
    low = np.maximum(np.floor(known.min(axis=0) - margin), 0).astype(int)
    high = np.ceil(known.max(axis=0) + margin).astype(int)
    crop = np.ascontiguousarray(gray[low[1] : high[1], low[0] : high[0]])
    seen = detect_markers(crop, config).get(number)
    if seen is None:
        return fix
    seen = seen + low
    if _jumped(seen, known):
        return update_fix(fix, gray, camera, config)
    return _merge(fix, {number: seen}, camera, config)


def _jumped(seen: Floats, known: Floats) -> bool:
    return bool(np.abs(seen - known).max() > _MOVED_PX)


def _merge(fix: TableFix, seen: Mapping[int, Floats], camera: CameraModel, config: FiducialConfig) -> TableFix:
    corners = dict(fix.corners)
    jumped = [number for number, pixel in seen.items() if number in corners and _jumped(pixel, corners[number].pixel)]
    if fix.view is not None and len(jumped) >= config.min_markers:
        # the camera has moved: every corner remembered from before is worth nothing
        return _merge(TableFix(), seen, camera, config)
    for number, pixel in seen.items():
        if number in jumped and fix.view is not None:
            continue  # one marker alone: half hidden, found in the wrong place
        known = corners.get(number)
        if known is None or number in jumped:
            corners[number] = Corners(pixel, 1)
            continue
        images = min(known.images + 1, _AVERAGED)
        corners[number] = Corners(known.pixel + (pixel - known.pixel) / images, images)
    if len(corners) < config.min_markers:
        problem = (
            f"no fiducials in view: {len(corners)} of the markers {list(config.ids)} ({config.dictionary}) seen, "
            f"{config.min_markers} needed"
        )
        return TableFix(corners, None, float("nan"), problem)
    view, residual = _solve(corners, camera, config, fix.view)
    # a corner that something hides in part is found in the wrong place
    while residual > config.max_residual_px and len(corners) > config.min_markers:
        rest = [{n: c for n, c in corners.items() if n != left_out} for left_out in corners]
        fits = [(_solve(some, camera, config, None), some) for some in rest]
        (view, residual), corners = min(fits, key=lambda fit: fit[0][1])
    if residual > config.max_residual_px:
        problem = (
            f"fiducials do not lie where configured: reprojection error {residual:.2f} px, "
            f"expected at most {config.max_residual_px} px"
        )
        return TableFix({}, None, residual, problem)
    return TableFix(corners, view, residual, "")


def _solve(
    corners: Mapping[int, Corners], camera: CameraModel, config: FiducialConfig, start: TableView | None
) -> tuple[TableView, float]:
    points = np.concatenate([marker_corners(config, number) for number in corners])
    pixels = np.concatenate([corner.pixel for corner in corners.values()])
    if start is None:
        _, rotation, translation = cv2.solvePnP(
            points, pixels, camera.matrix, camera.distortion, flags=cv2.SOLVEPNP_IPPE
        )
    else:
        rotation, translation = cv2.Rodrigues(start.rotation)[0], start.translation.reshape(3, 1).copy()
    rotation, translation = cv2.solvePnPRefineLM(
        points, pixels, camera.matrix, camera.distortion, rotation, translation
    )
    matrix = np.asarray(cv2.Rodrigues(rotation)[0], dtype=np.float64)
    view = TableView(camera, matrix, np.asarray(translation, dtype=np.float64).reshape(3))
    error = view.pixel_from_table(points) - pixels
    return view, float(np.sqrt((error**2).sum(axis=1).mean()))

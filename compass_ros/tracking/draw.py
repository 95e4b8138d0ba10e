"""What the tracker sees, drawn over the image, for people."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from compass_ros.tracking.config import TrackerConfig
from compass_ros.tracking.tracker import Frame, TrackerState

_SEEN, _PREDICTED, _MARKER, _TEXT = (60, 255, 60), (0, 170, 255), (255, 200, 0), (255, 255, 255)
_ANGLE = np.linspace(0, 2 * np.pi, 48, endpoint=False)
_CIRCLE = np.stack([np.cos(_ANGLE), np.sin(_ANGLE)], axis=-1)
_SHIFT = 4


def annotate(image: NDArray[np.uint8], state: TrackerState, frame: Frame, config: TrackerConfig) -> NDArray[np.uint8]:
    """A copy of the BGR image (H, W, 3) with fiducials, rims (orange: predicted, not seen), names and any problem."""
    out = image.copy()
    for number, corners in state.fix.corners.items():
        _outline(out, corners.pixel, _MARKER)
        _write(out, str(number), corners.pixel.mean(axis=0), _MARKER)
    view = state.fix.view
    for sighting in frame.sightings:
        if view is None:
            break
        look = config.objects[sighting.object]
        colour = _SEEN if sighting.seen else _PREDICTED
        rim = np.column_stack([sighting.xy + look.radius_m * _CIRCLE, np.full(len(_CIRCLE), look.height_m)])
        pixels = view.pixel_from_table(rim)
        _outline(out, pixels, colour)
        _write(out, f"{sighting.object} {sighting.std * 1e3:.1f} mm", pixels.max(axis=0) + np.array([2, -10]), colour)
    if frame.problem:
        _write(out, frame.problem[:90], np.array([8.0, 20.0]), _PREDICTED)
    return out


def _outline(image: NDArray[np.uint8], pixels: NDArray[np.float64], colour: tuple[int, int, int]) -> None:
    points = np.rint(pixels * (1 << _SHIFT)).astype(np.int32)
    cv2.polylines(image, [points], True, colour, 1, cv2.LINE_AA, _SHIFT)


def _write(image: NDArray[np.uint8], text: str, at: NDArray[np.float64], colour: tuple[int, int, int]) -> None:
    place = (int(at[0]), int(at[1]))
    cv2.putText(image, text, place, cv2.FONT_HERSHEY_SIMPLEX, 0.4, (0, 0, 0), 3, cv2.LINE_AA)
    cv2.putText(image, text, place, cv2.FONT_HERSHEY_SIMPLEX, 0.4, colour, 1, cv2.LINE_AA)

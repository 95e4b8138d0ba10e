"""Pixels of an image message (sensor_msgs/Image, live or from a bag) as an array."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from compass_ros.errors import TrackingError

_CHANNELS = {"bgr8": (0, 1, 2), "rgb8": (2, 1, 0), "bgra8": (0, 1, 2), "rgba8": (2, 1, 0)}
_DEPTH = {"bgr8": 3, "rgb8": 3, "bgra8": 4, "rgba8": 4}


def bgr_from_bytes(
    data: bytes | memoryview | NDArray[np.uint8], size: tuple[int, int], step: int, encoding: str
) -> NDArray[np.uint8]:
    """The image as BGR (H, W, 3). `size`: width and height, `step`: bytes from row to row, as in the message.

    Raises TrackingError for an encoding without colour, or a message cut short.
    """
    if encoding not in _CHANNELS:
        raise TrackingError(f"image encoding '{encoding}': expected a colour image, one of {sorted(_CHANNELS)}")
    (width, height), depth = size, _DEPTH[encoding]
    flat = np.frombuffer(data, dtype=np.uint8)
    if flat.size != height * step or step < width * depth:
        raise TrackingError(
            f"image is cut short: {flat.size} bytes for {height} rows of {step} bytes, {width} pixels each"
        )
    pixels = flat.reshape(height, step)[:, : width * depth].reshape(height, width, depth)
    order = _CHANNELS[encoding]
    return np.ascontiguousarray(pixels if encoding == "bgr8" else pixels[..., order])

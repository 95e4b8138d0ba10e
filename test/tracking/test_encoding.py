"""Every colour encoding gives the same picture; others, and messages cut short, one line."""

from __future__ import annotations

import numpy as np
import pytest

from compass_ros.errors import TrackingError
from compass_ros.tracking.encoding import bgr_from_bytes

BGR = np.random.default_rng(0).integers(0, 256, (4, 6, 3), dtype=np.uint8)


@pytest.mark.parametrize("padding", [0, 8])
@pytest.mark.parametrize("encoding", ["bgr8", "rgb8", "bgra8", "rgba8"])
def test_colour_images(encoding: str, padding: int) -> None:
    pixels = BGR[..., ::-1] if encoding.startswith("rgb") else BGR
    if encoding.endswith("a8"):
        pixels = np.dstack([pixels, np.full((4, 6), 255, np.uint8)])
    rows = np.pad(pixels.reshape(4, -1), ((0, 0), (0, padding)))
    image = bgr_from_bytes(rows.tobytes(), (6, 4), rows.shape[1], encoding)
    np.testing.assert_array_equal(image, BGR)
    assert image.flags.c_contiguous


def test_bad_messages() -> None:
    with pytest.raises(TrackingError, match="'mono8': expected a colour image"):
        bgr_from_bytes(bytes(24), (6, 4), 6, "mono8")
    with pytest.raises(TrackingError, match="cut short: 71 bytes for 4 rows of 18"):
        bgr_from_bytes(bytes(71), (6, 4), 18, "bgr8")
    with pytest.raises(TrackingError, match="cut short"):
        bgr_from_bytes(bytes(40), (6, 4), 10, "rgb8")

"""Many images -> tracks: of a video file, or of any sequence of stamped images (those of a bag, say)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from compass_ros.errors import TrackingError
from compass_ros.tracking.camera import CameraModel
from compass_ros.tracking.config import TrackerConfig
from compass_ros.tracking.tracker import Sighting, TrackerState, step
from compass_ros.types import Track


@dataclass(frozen=True)
class StampedImage:
    """One image of a sequence."""

    stamp_ns: int
    """Middle of the exposure, the sensor's clock."""
    bgr: NDArray[np.uint8]
    """(H, W, 3)."""


Tick = Callable[[int], None]
"""Told after every image how many have been used."""


def track_video(
    path: Path, camera: CameraModel, config: TrackerConfig, start_ns: int = 0, tick: Tick | None = None
) -> tuple[Track, ...]:
    """Tracks of the objects in a video file; image i is stamped start_ns + i / rate, with the rate of the file.

    Raises TrackingError if the file is no video, or if no image of it could be used.
    """
    return track_images(read_video(path, start_ns), camera, config, str(path), tick)


def track_images(
    images: Iterable[StampedImage], camera: CameraModel, config: TrackerConfig, where: str, tick: Tick | None = None
) -> tuple[Track, ...]:
    """Tracks of the objects that were seen, in the order of the configuration, quantity `xy`, frame `table`.

    A track holds the images in which the object was seen. Raises TrackingError naming `where` if the images do not fit
    the camera, if there are none, or if none could be used.
    """
    state = TrackerState()
    sightings: dict[str, list[Sighting]] = {name: [] for name in config.objects}
    count = used = 0
    problem = "no images"
    for image in images:
        try:
            state, frame = step(state, image.bgr, image.stamp_ns, camera, config)
        except TrackingError as error:
            raise TrackingError(f"{where}: image {count}: {error}") from error
        count += 1
        if frame.problem:
            problem = frame.problem
        else:
            used += 1
        for sighting in frame.sightings:
            if sighting.seen:
                sightings[sighting.object].append(sighting)
        if tick is not None:
            tick(count)
    if used == 0:
        raise TrackingError(f"{where}: none of {count} images could be used: {problem}")
    return tuple(_track(name, seen) for name, seen in sightings.items() if seen)


def read_video(path: Path, start_ns: int = 0) -> Iterator[StampedImage]:
    """Images of a video file. Raises TrackingError if it is missing, no video, or states no rate."""
    if not path.is_file():
        raise TrackingError(f"{path}: no such file")
    capture = cv2.VideoCapture(str(path))
    try:
        rate = float(capture.get(cv2.CAP_PROP_FPS))
        if not capture.isOpened() or not rate > 0:
            raise TrackingError(f"{path}: not a video that can be read")
        number = 0
        while True:
            ok, image = capture.read()
            if not ok:
                return
            yield StampedImage(start_ns + round(number * 1e9 / rate), np.asarray(image, dtype=np.uint8))
            number += 1
    finally:
        capture.release()


def video_length(path: Path) -> int:
    """Number of images that a video file says it holds; 0 when it does not say."""
    capture = cv2.VideoCapture(str(path))
    try:
        return max(int(capture.get(cv2.CAP_PROP_FRAME_COUNT)), 0)
    finally:
        capture.release()


def _track(name: str, seen: list[Sighting]) -> Track:
    return Track(
        object=name,
        quantity="xy",
        stamp_ns=np.array([s.stamp_ns for s in seen], dtype=np.int64),
        value=np.array([s.xy for s in seen]),
        std=np.array([s.std for s in seen]),
    )

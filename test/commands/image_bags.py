"""Bags with camera images, as a camera driver and a recorder leave them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from compass_ros.episodes.definitions import SHOT_TYPE, embedded_definition, typestore
from compass_ros.episodes.notes import Shot, shot_bytes
from compass_ros.episodes.writer import BagWriter

IMAGE, INFO = "sensor_msgs/msg/Image", "sensor_msgs/msg/CameraInfo"


def image_bag(
    folder: Path,
    images: Sequence[tuple[int, NDArray[np.uint8]]],
    matrix: Sequence[float],
    distortion: Sequence[float] = (),
    shot: Shot | None = None,
) -> Path:
    """A bag with stamped [ns] BGR images, a camera_info each, and perhaps a shot command before them."""
    store = typestore()
    types = store.types
    writer = BagWriter(folder)
    channels = {kind: writer.add_topic(name, embedded_definition(kind)) for name, kind in _TOPICS.items()}
    if shot is not None:
        writer.write(channels[SHOT_TYPE], shot.stamp_ns, shot.stamp_ns, shot_bytes(shot))
    roi = types["sensor_msgs/msg/RegionOfInterest"](0, 0, 0, 0, False)
    k, turn, d = np.array(matrix, float), np.eye(3).ravel(), np.array(distortion, float)
    for stamp_ns, bgr in images:
        height, width = bgr.shape[:2]
        stamp = types["builtin_interfaces/msg/Time"](sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9)
        header = types["std_msgs/msg/Header"](stamp=stamp, frame_id="camera")
        info = types[INFO](header, height, width, "plumb_bob", d, k, turn, np.zeros(12), 0, 0, roi)
        image = types[IMAGE](header, height, width, "bgr8", 0, 3 * width, np.ascontiguousarray(bgr).ravel())
        for kind, message in ((INFO, info), (IMAGE, image)):
            writer.write(channels[kind], stamp_ns, stamp_ns, bytes(store.serialize_cdr(message, kind)))
    writer.close()
    return folder


_TOPICS = {"/virtual_cell/shot": SHOT_TYPE, "/camera_info": INFO, "/image": IMAGE}

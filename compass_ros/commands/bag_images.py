"""Camera images and camera_info of a bag, as the tracker takes them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from compass_ros.episodes import TopicSummary, list_topics
from compass_ros.episodes.bag import RawMessage, decode, scan
from compass_ros.episodes.notes import stamp_ns
from compass_ros.errors import BagError, TrackingError
from compass_ros.tracking.camera import CameraModel, camera_model
from compass_ros.tracking.encoding import bgr_from_bytes
from compass_ros.tracking.video import StampedImage

IMAGE_TYPE = "sensor_msgs/msg/Image"
INFO_TYPE = "sensor_msgs/msg/CameraInfo"


def image_topic(bag: Path, name: str = "") -> TopicSummary:
    """The topic with images, by name or, where there is one only, without. Raises BagError."""
    topics = list_topics(bag)
    found = [topic for topic in topics if topic.type == IMAGE_TYPE and topic.name == (name or topic.name)]
    if len(found) == 1:
        return found[0]
    if found:
        raise BagError(
            f"{bag}: {len(found)} topics with images; choose one: {', '.join(topic.name for topic in found)}"
        )
    has = ", ".join(f"{topic.name} ({topic.type})" for topic in topics) or "nothing"
    raise BagError(f"{bag}: expected images{f' on {name}' * bool(name)} ({IMAGE_TYPE}); it has {has}")


def images_of(bag: Path, topic: str) -> Iterator[StampedImage]:
    """All images of a topic, in the order of the bag. Raises BagError, TrackingError."""
    for item in scan(bag):
        if isinstance(item, RawMessage) and item.topic.name == topic:
            image: Any = decode(item)
            size = (image.width, image.height)
            bgr = bgr_from_bytes(image.data, size, image.step, image.encoding)
            yield StampedImage(stamp_ns(image.header.stamp), bgr)


def camera_of(bag: Path) -> CameraModel:
    """The camera of the first camera_info. Raises TrackingError where there is none."""
    for item in scan(bag):
        if isinstance(item, RawMessage) and item.topic.type == INFO_TYPE:
            info: Any = decode(item)
            where = f"{bag}: {item.topic.name}"
            return camera_model((info.width, info.height), list(info.k), info.distortion_model, list(info.d), where)
    raise TrackingError(f"{bag}: no camera_info ({INFO_TYPE}); give the camera's calibration with --camera")

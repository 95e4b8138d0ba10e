"""Images, camera_info and sightings as messages, and back."""

from __future__ import annotations

import array
import math
from collections.abc import Iterable, Mapping

import numpy as np
from builtin_interfaces.msg import Duration, Time
from geometry_msgs.msg import (
    Point,
    Pose,
    PoseWithCovarianceStamped,
    Quaternion,
    Transform,
    TransformStamped,
    Vector3,
)
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from sensor_msgs.msg import CameraInfo, Image, JointState
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from compass_ros.tracking.camera import CameraModel, camera_model
from compass_ros.tracking.config import TrackerConfig
from compass_ros.tracking.encoding import bgr_from_bytes
from compass_ros.tracking.frames import Place
from compass_ros.tracking.tracker import Sighting
from compass_ros.types import Floats

_SECOND_NS = 1_000_000_000
_UNKNOWN_YAW_VARIANCE = math.pi**2 / 3
"""A round object shows no yaw: uniform over the circle [rad^2]."""


def stamp_message(stamp_ns: int) -> Time:
    return Time(sec=stamp_ns // _SECOND_NS, nanosec=stamp_ns % _SECOND_NS)


def stamp_ns(stamp: Time) -> int:
    return int(stamp.sec * _SECOND_NS + stamp.nanosec)


def header(at_ns: int, frame: str) -> Header:
    return Header(stamp=stamp_message(at_ns), frame_id=frame)


def image_from_message(message: Image) -> NDArray[np.uint8]:
    """The image as BGR (H, W, 3). Raises TrackingError for an encoding without colour, or a message cut short."""
    size = (message.width, message.height)
    return bgr_from_bytes(memoryview(message.data), size, message.step, message.encoding)


def image_message(bgr: NDArray[np.uint8], head: Header) -> Image:
    height, width = bgr.shape[:2]
    message = Image(header=head, height=height, width=width, encoding="bgr8", step=3 * width)
    message.data = array.array("B", bgr.tobytes())
    return message


def camera_from_message(message: CameraInfo) -> CameraModel:
    """Raises TrackingError for a camera that is not calibrated or whose distortion is not known."""
    size = (message.width, message.height)
    return camera_model(size, list(message.k), message.distortion_model, list(message.d), "camera_info")


def camera_info_message(camera: CameraModel, head: Header) -> CameraInfo:
    k = camera.matrix
    projection = np.hstack([k, np.zeros((3, 1))])
    return CameraInfo(
        header=head, width=camera.width, height=camera.height, distortion_model="plumb_bob",
        d=camera.distortion.tolist(), k=k.ravel().tolist(), r=np.eye(3).ravel().tolist(), p=projection.ravel().tolist(),
    )  # fmt: skip


def transform_message(place: Place, parent: str, child: str, at: Time) -> TransformStamped:
    """Where the frame `child` is in `parent`."""
    x, y, z, w = Rotation.from_matrix(place.rotation).as_quat().tolist()
    px, py, pz = place.translation.tolist()
    transform = Transform(translation=Vector3(x=px, y=py, z=pz), rotation=Quaternion(x=x, y=y, z=z, w=w))
    return TransformStamped(header=Header(stamp=at, frame_id=parent), child_frame_id=child, transform=transform)


def place_of(transform: Transform) -> Place:
    """An orientation of zeros, which is none, counts as the identity."""
    p, q = transform.translation, transform.rotation
    numbers = [q.x, q.y, q.z, q.w]
    rotation = Rotation.from_quat(numbers).as_matrix() if any(numbers) else np.eye(3)
    return Place(rotation, np.array([p.x, p.y, p.z]))


def pose_message(sighting: Sighting, frame: str) -> PoseWithCovarianceStamped:
    """Position on the table's surface, in the table's frame; the orientation is the identity, with a yaw that is stated
    as not known."""
    message = PoseWithCovarianceStamped(header=header(sighting.stamp_ns, frame))
    x, y = sighting.xy.tolist()
    message.pose.pose = Pose(position=Point(x=x, y=y), orientation=Quaternion(w=1.0))
    covariance = np.zeros((6, 6))
    covariance[:2, :2] = sighting.covariance
    covariance[5, 5] = _UNKNOWN_YAW_VARIANCE
    message.pose.covariance = covariance.ravel().tolist()
    return message


def markers_message(sightings: Iterable[Sighting], config: TrackerConfig, head: Header) -> MarkerArray:
    """Discs in the frame of `head` in their colours, pale where predicted; each vanishes when it is not renewed."""
    markers = []
    for number, sighting in enumerate(sightings):
        look = config.objects[sighting.object]
        x, y = sighting.xy.tolist()
        markers.append(
            Marker(
                header=head,
                ns=sighting.object,
                id=number,
                type=Marker.CYLINDER,
                action=Marker.ADD,
                pose=Pose(position=Point(x=x, y=y, z=look.height_m / 2), orientation=Quaternion(w=1.0)),
                scale=Vector3(x=2 * look.radius_m, y=2 * look.radius_m, z=look.height_m),
                color=_colour(look.hue_deg, 1.0 if sighting.seen else 0.35),
                lifetime=Duration(nanosec=300_000_000),
            )
        )
    return MarkerArray(markers=markers)


def joint_message(joints: Mapping[str, float], head: Header) -> JointState:
    return JointState(header=head, name=list(joints), position=[float(angle) for angle in joints.values()])


def covariance_of(message: PoseWithCovarianceStamped) -> Floats:
    """(2, 2) of x and y [m^2]."""
    return np.asarray(message.pose.covariance).reshape(6, 6)[:2, :2]


def _colour(hue_deg: float, alpha: float) -> ColorRGBA:
    red, green, blue = (
        min(max(abs((hue_deg / 60 + shift) % 6 - 3) - 1, 0.0), 1.0) * 0.9 + 0.05 for shift in (0.0, 4.0, 2.0)
    )
    return ColorRGBA(r=red, g=green, b=blue, a=alpha)

"""Node `puck_tracker`: camera images -> poses of the objects on the table.

Poses carry the stamp of their image, which is the middle of its exposure in the sensor's clock. An object that is seen
is published as measured; one that is hidden is published as predicted, with a standard deviation of at least
`bridged_std_m` that grows, and no longer after `bridge_s`.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import PoseWithCovarianceStamped
from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile, ReliabilityPolicy, qos_profile_sensor_data
from sensor_msgs.msg import CameraInfo, Image
from visualization_msgs.msg import MarkerArray

from compass_ros.errors import CompassError
from compass_ros.nodes import images
from compass_ros.nodes.run import run
from compass_ros.nodes.tracker_parameters import declare_tracker, tracker_of
from compass_ros.tracking.camera import CameraModel
from compass_ros.tracking.draw import annotate
from compass_ros.tracking.tracker import Frame, TrackerState, step, use_one_core

SENSOR_IN = QoSProfile(depth=30, reliability=ReliabilityPolicy.BEST_EFFORT)
"""Half a second of images may wait while the machine is busy elsewhere; none is lost before."""
DEBUG_EVERY = 4
"""One image in this many is annotated."""


@dataclass
class Counts:
    """Since the last diagnostics."""

    images: int = 0
    missed: int = 0
    unusable: int = 0
    busy_s: float = 0.0
    seen: dict[str, int] = field(default_factory=dict)


class PuckTracker(Node):
    """Image in, poses out; the work is `compass_ros.tracking.tracker.step`."""

    def __init__(self) -> None:
        super().__init__("puck_tracker")
        self._config = declare_tracker(self)
        self._state = TrackerState()
        self._camera: CameraModel | None = None
        self._problem = "no image yet"
        self._counts = Counts()
        self._period_ns: int | None = None

        self._poses = {
            name: self.create_publisher(PoseWithCovarianceStamped, f"~/{name}/pose", qos_profile_sensor_data)
            for name in self._config.objects
        }
        self._markers = self.create_publisher(MarkerArray, "~/markers", 10)
        self._debug = self.create_publisher(Image, "~/debug_image", qos_profile_sensor_data)
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self.create_subscription(CameraInfo, "camera_info", self._on_camera, qos_profile_sensor_data)
        self.create_subscription(Image, "image", self._on_image, SENSOR_IN)
        self.create_timer(1.0, self._diagnose)
        self.add_on_set_parameters_callback(self._on_parameters)

    def _on_parameters(self, changes: list[Parameter]) -> SetParametersResult:
        try:
            config = tracker_of(self, changes)
        except CompassError as error:
            return SetParametersResult(successful=False, reason=str(error))
        if config.fiducials != self._config.fiducials:
            self._state = TrackerState()
        self._config = config
        return SetParametersResult(successful=True)

    def _on_camera(self, message: CameraInfo) -> None:
        try:
            self._camera = images.camera_from_message(message)
        except CompassError as error:
            self._complain(str(error))

    def _on_image(self, message: Image) -> None:
        started = time.perf_counter()
        stamp_ns = images.stamp_ns(message.header.stamp)
        self._count(stamp_ns)
        if self._camera is None:
            self._complain("no camera_info yet: images wait for it")
            return
        try:
            bgr = images.image_from_message(message)
            self._state, frame = step(self._state, bgr, stamp_ns, self._camera, self._config)
        except CompassError as error:
            self._complain(str(error))
            return
        self._complain(frame.problem)
        self._publish(frame)
        self._counts.busy_s += time.perf_counter() - started
        if self._counts.images % DEBUG_EVERY == 0 and self._debug.get_subscription_count():
            seen = annotate(bgr, self._state, frame, self._config)
            self._debug.publish(images.image_message(seen, message.header))

    def _publish(self, frame: Frame) -> None:
        for sighting in frame.sightings:
            self._poses[sighting.object].publish(images.pose_message(sighting))
            self._counts.seen[sighting.object] = self._counts.seen.get(sighting.object, 0) + sighting.seen
        if self._markers.get_subscription_count():
            self._markers.publish(images.markers_message(frame.sightings, self._config, frame.stamp_ns))

    def _count(self, stamp_ns: int) -> None:
        """Images, and gaps in their stamps: the least period seen is the camera's."""
        self._counts.images += 1
        last = self._state.stamp_ns
        if last is None or stamp_ns <= last:
            return
        gap = stamp_ns - last
        self._period_ns = gap if self._period_ns is None else min(gap, self._period_ns)
        self._counts.missed += round(gap / self._period_ns) - 1

    def _complain(self, problem: str) -> None:
        """Say a problem once, when it begins; count the images that it costs."""
        if problem:
            self._counts.unusable += 1
        if problem.split(":", maxsplit=1)[0] != self._problem.split(":", maxsplit=1)[0]:
            if problem:
                self.get_logger().warning(problem)
            else:
                self.get_logger().info(f"table found, reprojection error {self._state.fix.residual_px:.2f} px")
        self._problem = problem

    def _diagnose(self) -> None:
        counts, self._counts = self._counts, Counts()
        problem = self._problem if counts.images else "no images"
        values = {
            "images": counts.images,
            "missed images": counts.missed,
            "unusable images": counts.unusable,
            "ms an image": f"{1e3 * counts.busy_s / max(counts.images, 1):.2f}",
            "reprojection error [px]": f"{self._state.fix.residual_px:.3f}",
            **{f"seen {name}": counts.seen.get(name, 0) for name in self._config.objects},
        }
        status = DiagnosticStatus(
            level=DiagnosticStatus.WARN if problem else DiagnosticStatus.OK,
            name=f"{self.get_name()}: tracking",
            message=problem or "tracking",
            values=[KeyValue(key=key, value=str(value)) for key, value in values.items()],
        )
        head = images.header(self.get_clock().now().nanoseconds, "")
        self._diagnostics.publish(DiagnosticArray(header=head, status=[status]))


def main() -> None:
    use_one_core()
    run(PuckTracker, "puck_tracker")


if __name__ == "__main__":
    main()

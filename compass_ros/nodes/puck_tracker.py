"""Node `puck_tracker`: camera images -> poses of the objects on the table.

Poses carry the stamp of their image, which is the middle of its exposure in the sensor's clock. An object that is seen
is published as measured; one that is hidden is published as predicted, with a standard deviation of at least
`bridged_std_m` that grows, and no longer after `bridge_s`. A watchdog says so when the camera stops, the table moves or
an object is lost.
"""

from __future__ import annotations

import time
from collections.abc import Mapping

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseWithCovarianceStamped
from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor, SetParametersResult
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile, ReliabilityPolicy, qos_profile_sensor_data
from sensor_msgs.msg import CameraInfo, Image
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

from compass_ros.errors import CompassError
from compass_ros.nodes import images
from compass_ros.nodes.camera_frame import CameraFrame
from compass_ros.nodes.managed import ManagedNode
from compass_ros.nodes.qos import RELIABLE
from compass_ros.nodes.requests import wrong_text
from compass_ros.nodes.run import run
from compass_ros.nodes.tracker_health import Counts, StampGaps, health_message
from compass_ros.nodes.tracker_parameters import declare_tracker, tracker_of
from compass_ros.tracking.camera import CameraModel
from compass_ros.tracking.draw import annotate
from compass_ros.tracking.tracker import Frame, TrackerState, step, use_one_core
from compass_ros.tracking.watchdog import Watch, accept, complaints, look

SENSOR_IN = QoSProfile(depth=30, reliability=ReliabilityPolicy.BEST_EFFORT)
"""Half a second of images may wait while the machine is busy elsewhere; none is lost before."""
DEBUG_EVERY = 4
"""One image in this many is annotated."""
DIAGNOSTICS_PERIOD_S = 1.0


class PuckTracker(ManagedNode):
    """Image in, poses out; the work is `compass_ros.tracking.tracker.step`."""

    def __init__(self) -> None:
        super().__init__("puck_tracker")
        self._config = declare_tracker(self)
        self._camera_timeout_s = self._limit("camera_timeout_s", 0.5, "the camera has stopped after this [s]", 60.0)
        self._moved_m = self._limit("moved_m", 0.002, "a table that is farther from its place has moved [m]", 1.0)
        self._lost_s = self._limit("lost_s", 2.0, "an object that is not seen for longer is lost [s]", 3600.0)
        self.declare_fixed("frame", "table", "frame of the poses: origin at the centre of the table, z up", wrong_text)
        tf = "hang the camera's frame (the root of its tree) below `frame` in TF, where the fiducials place it"
        self.declare_fixed("publish_tf", True, tf)
        self._forget()
        self.add_on_set_parameters_callback(self._on_parameters)

    def _limit(self, name: str, default: float, text: str, most: float) -> float:
        limits = [FloatingPointRange(from_value=0.0, to_value=most)]
        described = ParameterDescriptor(description=f"watchdog: {text}", floating_point_range=limits)
        return float(self.declare_parameter(name, default, described).value)

    def _forget(self) -> None:
        self._state = TrackerState()
        self._watch = Watch()
        self._camera: CameraModel | None = None
        self._problem = "no image yet"
        self._counts = Counts()
        self._gaps = StampGaps()
        self._image_frame = ""
        self._heard_s = self._diagnosed_s = time.monotonic()

    def configure(self) -> None:
        self._forget()
        self._frame = str(self.get_parameter("frame").value)
        self._camera_frame = CameraFrame(self, self._frame) if self.get_parameter("publish_tf").value else None
        self._poses = {
            name: self.create_publisher(PoseWithCovarianceStamped, f"~/{name}/pose", RELIABLE)
            for name in self._config.objects
        }
        self._markers = self.create_publisher(MarkerArray, "~/markers", 10)
        self._debug = self.create_publisher(Image, "~/debug_image", RELIABLE)
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self.create_subscription(CameraInfo, "camera_info", self._on_camera, qos_profile_sensor_data)
        self.create_subscription(Image, "image", self._on_image, SENSOR_IN)
        self.create_service(Trigger, "~/accept_table", self._on_accept)
        self.every(DIAGNOSTICS_PERIOD_S, self._diagnose)

    def activate(self) -> None:
        self._heard_s = time.monotonic()

    def _on_parameters(self, changes: list[Parameter]) -> SetParametersResult:
        try:
            config = tracker_of(self, changes)
        except CompassError as error:
            return SetParametersResult(successful=False, reason=str(error))
        if config.fiducials != self._config.fiducials:
            self._state, self._watch = TrackerState(), Watch()
        self._config = config
        given = {change.name: change.value for change in changes}
        self._camera_timeout_s = given.get("camera_timeout_s", self._camera_timeout_s)
        self._moved_m = given.get("moved_m", self._moved_m)
        self._lost_s = given.get("lost_s", self._lost_s)
        return SetParametersResult(successful=True)

    def _on_camera(self, message: CameraInfo) -> None:
        try:
            self._camera = images.camera_from_message(message)
        except CompassError as error:
            self._complain(str(error))

    def _on_image(self, message: Image, info: Mapping[str, int]) -> None:
        if not self.active:
            return
        started = time.perf_counter()
        self._heard_s = time.monotonic()
        self._image_frame = message.header.frame_id
        stamp_ns = images.stamp_ns(message.header.stamp)
        self._counts.images += 1
        self._counts.missed += self._gaps.take(stamp_ns)
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
        self._counts.latency_ms.append(1e-6 * (time.time_ns() - info["received_timestamp"]))
        self._counts.age_ms.append(1e-6 * (self.get_clock().now().nanoseconds - stamp_ns))
        self._counts.take(frame)
        self._watch = look(self._watch, self._state, frame, self._config.fiducials)
        self._counts.busy_s += time.perf_counter() - started
        if self._counts.images % DEBUG_EVERY == 0 and self._debug.get_subscription_count():
            seen = annotate(bgr, self._state, frame, self._config)
            self._debug.publish(images.image_message(seen, message.header))

    def _publish(self, frame: Frame) -> None:
        for sighting in frame.sightings:
            self._poses[sighting.object].publish(images.pose_message(sighting, self._frame))
        if self._markers.get_subscription_count():
            head = images.header(frame.stamp_ns, self._frame)
            self._markers.publish(images.markers_message(frame.sightings, self._config, head))

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

    def problems(self) -> list[str]:
        """What the watchdog says now, too."""
        said = super().problems()
        if not self.active:
            return said
        topics = ["image", *(["camera_info"] if self._camera is None else [])]
        deaf = [f"{self.resolve_topic_name(t)} has no publisher" for t in topics if not self.count_publishers(t)]
        silent_s = time.monotonic() - self._heard_s
        if not deaf and silent_s > self._camera_timeout_s:
            deaf = [f"the camera has stopped: no images for {silent_s:.1f} s"]
        return [*said, *(deaf or complaints(self._watch, self._config.objects, self._moved_m, self._lost_s))]

    def _on_accept(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        moved_mm = 1e3 * self._watch.moved_m
        self._watch = accept(self._watch)
        response.success = True
        response.message = f"accepted: the table may stand where it stands, {moved_mm:.1f} mm from where it was"
        return response

    def _diagnose(self) -> None:
        counts, self._counts = self._counts, Counts()
        now_s = time.monotonic()
        seconds, self._diagnosed_s = now_s - self._diagnosed_s, now_s
        own = self._problem if self.active else f"not active, but {self.state}"
        problems = [*self.problems(), *filter(None, [own])]
        residual_px = self._state.fix.residual_px
        name = self.get_fully_qualified_name()
        status = health_message(name, counts, seconds, residual_px, self._config.objects, problems)
        head = images.header(self.get_clock().now().nanoseconds, "")
        if self._camera_frame is not None and self._state.fix.view is not None:
            self._camera_frame.place(self._image_frame, self._state.fix.view, head.stamp)
        self._diagnostics.publish(DiagnosticArray(header=head, status=[status]))


def main() -> None:
    use_one_core()
    run(PuckTracker, "puck_tracker")


if __name__ == "__main__":
    main()

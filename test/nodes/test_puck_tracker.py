"""The tracker as a process, fed with drawn images: poses and their stamps, parameters, and what it says of trouble."""

from __future__ import annotations

import time
from collections.abc import Callable
from itertools import count

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseWithCovarianceStamped, TransformStamped
from numpy.typing import NDArray
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import DescribeParameters, SetParameters
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import CameraInfo, Image
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from compass_ros.nodes.images import (
    camera_info_message,
    covariance_of,
    header,
    image_from_message,
    image_message,
    place_of,
    stamp_message,
    stamp_ns,
    transform_message,
)
from compass_ros.tracking.frames import Place
from compass_ros.tracking.scene_config import SceneConfig
from compass_ros.tracking.virtual_camera import VirtualCamera, make_camera, render
from test.nodes.conftest import StartNode
from test.nodes.harness import LATCHED, PATIENCE_S, RELIABLE, NodeProcess, Probe, until

pytestmark = pytest.mark.ros
SENSOR = QoSProfile(depth=30, reliability=ReliabilityPolicy.BEST_EFFORT)
PLACES = {"puck1": (-0.1, -0.1), "puck2": (0.25, 0.1), "pusher": (-0.2, 0.07)}
T0 = 1_700_000_000_123_456_789
Send = Callable[..., int]


@pytest.fixture(scope="module")
def camera() -> VirtualCamera:
    return make_camera(SceneConfig())


@pytest.fixture
def tracker(start_node: StartNode) -> NodeProcess:
    return start_node("puck_tracker")


@pytest.fixture
def send(probe: Probe, tracker: NodeProcess, camera: VirtualCamera) -> Send:
    """A function that publishes one image, 1/60 s after the last, and returns its stamp [ns]."""
    info = probe.publisher(CameraInfo, "/camera_info", SENSOR)
    image = probe.publisher(Image, "/image", SENSOR)
    sent: list[int] = []

    def publish(picture: NDArray[np.uint8] | None = None, places: dict[str, tuple[float, float]] = PLACES) -> int:
        sent.append(T0 + len(sent) * 16_666_667)
        head = header(sent[-1], "optical")
        poses = {name: np.tile([*xy, 0.0], (5, 1)) for name, xy in places.items()}
        info(camera_info_message(camera.scene.view.camera, head))
        image(image_message(render(camera, poses, len(sent)) if picture is None else picture, head))
        return sent[-1]

    return publish


def set_double(probe: Probe, name: str, value: float) -> tuple[bool, str]:
    new = Parameter(name=name, value=ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=value))
    request = SetParameters.Request(parameters=[new])
    (answer,) = probe.call(SetParameters, "/puck_tracker/set_parameters", request).results
    return answer.successful, answer.reason


def test_poses_have_the_stamp_of_their_image_and_say_when_they_are_predicted(probe: Probe, send: Send) -> None:
    heard = {name: probe.listen(PoseWithCovarianceStamped, f"/puck_tracker/{name}/pose", SENSOR) for name in PLACES}
    markers = probe.listen(MarkerArray, "/puck_tracker/markers")
    debug = probe.listen(Image, "/puck_tracker/debug_image", SENSOR)
    until(lambda: bool(send()) and all(heard.values()), "the first poses")
    stamp = send()
    for name, (x, y) in PLACES.items():
        pose = probe.wait_for(heard[name], lambda p: stamp_ns(p.header.stamp) == stamp)
        assert pose.header.frame_id == "table"
        assert np.hypot(pose.pose.pose.position.x - x, pose.pose.pose.position.y - y) < 0.001
        assert np.sqrt(covariance_of(pose)[0, 0]) < 0.001
        assert pose.pose.covariance[35] > 3, "a round puck shows no yaw"

    hidden = send(places={name: xy for name, xy in PLACES.items() if name != "puck2"})
    pose = probe.wait_for(heard["puck2"], lambda p: stamp_ns(p.header.stamp) == hidden)
    assert np.sqrt(covariance_of(pose)[0, 0]) >= 0.01
    assert {m.ns for m in probe.wait_for(markers).markers} == set(PLACES)
    until(lambda: bool(send()) and bool(debug), "an annotated image")
    assert debug[0].width == 640


def test_the_camera_hangs_below_the_tables_frame_and_all_hear_it(
    start_node: StartNode, probe: Probe, camera: VirtualCamera
) -> None:
    """Where the driver has a tree of frames its root is hung; poses and images are offered as reliable."""
    start_node("puck_tracker", frame="bench")
    tree = probe.node.create_publisher(TFMessage, "/tf_static", LATCHED)
    known = transform_message(Place(np.eye(3), np.array([0.0, 0.015, 0.0])), "link", "optical", stamp_message(0))
    tree.publish(TFMessage(transforms=[known]))
    said = probe.listen(TFMessage, "/tf_static", QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL))
    poses = probe.listen(PoseWithCovarianceStamped, "/puck_tracker/puck1/pose", RELIABLE)
    debug = probe.listen(Image, "/puck_tracker/debug_image", RELIABLE)
    markers = probe.listen(MarkerArray, "/puck_tracker/markers", RELIABLE)
    info, image = probe.publisher(CameraInfo, "/camera_info", SENSOR), probe.publisher(Image, "/image", SENSOR)
    picture = render(camera, {name: np.tile([*xy, 0.0], (5, 1)) for name, xy in PLACES.items()}, 1)

    numbers = count()

    def found() -> list[TransformStamped]:
        head = header(T0 + 16_666_667 * next(numbers), "optical")
        info(camera_info_message(camera.scene.view.camera, head))
        image(image_message(picture, head))
        time.sleep(0.01)
        return [t for message in said for t in message.transforms if t.header.frame_id == "bench"]

    until(lambda: bool(found()) and bool(poses) and bool(debug) and bool(markers), "the camera's place, and the rest")
    (hung, *_) = found()
    assert hung.child_frame_id == "link"
    seen = place_of(hung.transform) @ place_of(known.transform)
    view = camera.scene.view
    assert seen.near(Place(view.rotation.T, view.position), 0.003, 0.003)
    assert poses[0].header.frame_id == markers[0].markers[0].header.frame_id == "bench"


def test_parameters_are_described_and_take_effect_while_it_runs(probe: Probe, send: Send) -> None:
    request = DescribeParameters.Request(names=["objects.puck2.hue_deg", "min_arc", "fiducials.min_markers"])
    described = probe.call(DescribeParameters, "/puck_tracker/describe_parameters", request).descriptors
    assert all(one.description for one in described)
    assert described[0].floating_point_range[0].to_value == 360
    assert described[1].floating_point_range[0].from_value == 0.15
    assert described[2].integer_range[0].from_value == 2

    heard = probe.listen(PoseWithCovarianceStamped, "/puck_tracker/puck2/pose", SENSOR)
    until(lambda: bool(send()) and bool(heard), "a pose")
    assert set_double(probe, "objects.puck2.hue_deg", 60.0) == (True, "")
    stamp = send()
    pose = probe.wait_for(heard, lambda p: stamp_ns(p.header.stamp) == stamp)
    assert np.sqrt(covariance_of(pose)[0, 0]) >= 0.01, "no yellow puck is there: the old place is predicted"
    assert not set_double(probe, "objects.puck2.hue_deg", 400.0)[0]
    accepted, reason = set_double(probe, "gate_m", 0.0)  # the range's end, which the configuration does not include
    assert not accepted
    assert "gate_m" in reason


def test_trouble_is_said_once_in_one_line_and_passes(
    probe: Probe, tracker: NodeProcess, send: Send, camera: VirtualCamera
) -> None:
    diagnostics = probe.listen(DiagnosticArray, "/diagnostics")
    heard = probe.listen(PoseWithCovarianceStamped, "/puck_tracker/puck1/pose", SENSOR)
    gray = np.full((480, 640, 3), 120, np.uint8)

    def said(text: str) -> bool:
        return any(text in a.status[0].message and a.status[0].level == DiagnosticStatus.WARN for a in diagnostics)

    until(lambda: bool(send(gray)) and said("no fiducials in view: 0 of the markers"), "the problem")
    until(lambda: bool(send()) and bool(heard), "a pose after the trouble")
    assert tracker.output().count("no fiducials in view") == 1
    until(lambda: bool(send(gray[:240])) and "camera_info says 640x480" in tracker.output(), "a size complaint")
    count = len(heard)
    until(lambda: bool(send()) and len(heard) > count, "a pose after a bad image")
    assert tracker.stop() == 0
    assert "Traceback" not in tracker.output()


def test_the_watchdog_says_each_alarm_once(
    probe: Probe, tracker: NodeProcess, send: Send, camera: VirtualCamera
) -> None:
    diagnostics = probe.listen(DiagnosticArray, "/diagnostics")

    def said(text: str) -> bool:
        return bool(diagnostics) and text in diagnostics[-1].status[0].message

    until(lambda: "the camera has stopped: no images for" in tracker.output(), "a camera that never spoke")
    until(lambda: bool(send()) and said("tracking"), "all is well")
    values = {pair.key: pair.value for pair in diagnostics[-1].status[0].values}
    assert float(values["share of images with puck1"]) > 0.9
    assert 0 < float(values["latency p50 [ms]"]) <= float(values["latency p99 [ms]"]) < 1000
    until(lambda: tracker.output().count("over: the camera has stopped") == 1, "the end of the first alarm")
    until(lambda: said("the camera has stopped"), "the camera's silence")
    until(lambda: tracker.output().count("the camera has stopped: no images") == 2, "the same in the log")

    gone = {name: xy for name, xy in PLACES.items() if name != "puck1"}
    until(lambda: bool(send(places=gone)) and said("puck1 is lost: not seen for"), "the loss of a puck")
    picture = render(camera, {name: np.tile([*xy, 0.0], (5, 1)) for name, xy in PLACES.items()}, 1)
    pushed = np.roll(picture, 4, axis=1)  # the camera is turned by four pixels
    until(lambda: bool(send(pushed)) and said("the table has moved by"), "the push")
    assert "accepted: the table may stand" in probe.call(Trigger, "/puck_tracker/accept_table").message
    until(lambda: bool(send(pushed)) and said("tracking"), "the end of the alarm")
    assert tracker.output().count("put it back, or accept its place") == 1


def test_bad_parameters_at_the_start_end_it_with_one_line(start_node: StartNode) -> None:
    node = start_node("puck_tracker", **{"fiducials.ids": [1, 1, 2, 3]})
    assert node.process.wait(PATIENCE_S) == 1
    assert "puck_tracker: parameters of puck_tracker: fiducials: expected distinct ids" in node.output()
    assert "Traceback" not in node.output()


def test_an_image_survives_its_message() -> None:
    bgr = np.random.default_rng(0).integers(0, 256, (4, 6, 3), dtype=np.uint8)
    np.testing.assert_array_equal(image_from_message(image_message(bgr, header(5, "f"))), bgr)

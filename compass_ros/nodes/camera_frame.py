"""The camera's frame below the table's in TF, where the fiducials say that it is."""

from __future__ import annotations

from builtin_interfaces.msg import Time
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from tf2_msgs.msg import TFMessage

from compass_ros.nodes.images import place_of, transform_message
from compass_ros.nodes.qos import LATCHED
from compass_ros.tracking.camera import TableView
from compass_ros.tracking.frames import Hanging, Place, hang

TOPIC = "/tf_static"
MOVED_M, MOVED_RAD = 0.001, 0.001
"""A camera that seems to be farther from where it was said to be is said again: the fiducials place it to a tenth."""
_EVERY_PUBLISHER = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class CameraFrame:
    """Of a configured tracker: listens for the camera's own tree and hangs its root below the table."""

    def __init__(self, node: Node, table: str) -> None:
        self._node = node
        self._table = table
        self._tree: dict[str, tuple[str, Place]] = {}
        self._said: Hanging | None = None
        self._topic = node.create_publisher(TFMessage, TOPIC, LATCHED)
        node.create_subscription(TFMessage, TOPIC, self._on_transforms, _EVERY_PUBLISHER)

    def place(self, camera: str, view: TableView, at: Time) -> None:
        """Where the camera's frame is, as of now."""
        found = hang(camera, Place(view.rotation.T, view.position), self._table, self._tree)
        if found is None or not camera or self._is_said(found):
            return
        self._said = found
        self._topic.publish(TFMessage(transforms=[transform_message(found.place, self._table, found.child, at)]))

    def _is_said(self, found: Hanging) -> bool:
        said = self._said
        return said is not None and said.child == found.child and said.place.near(found.place, MOVED_M, MOVED_RAD)

    def _on_transforms(self, message: TFMessage) -> None:
        for one in message.transforms:
            parent, child = one.header.frame_id.lstrip("/"), one.child_frame_id.lstrip("/")
            if self._said is None or (parent, child) != (self._table, self._said.child):  # what we have said ourselves
                self._tree[child] = (parent, place_of(one.transform))

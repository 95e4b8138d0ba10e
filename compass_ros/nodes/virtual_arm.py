"""The arm of the virtual cell as its driver publishes it: what its encoders count, what it was told, where its tool is.

The arm moves its tool along two axes, which the scene has as joints; shoulder and elbow are those of the arm that is
drawn. All positions come from the counts. Nothing is made for a topic that nobody listens to.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from geometry_msgs.msg import Point, Pose, PoseStamped, Quaternion
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState
from tf2_msgs.msg import TFMessage

from compass_ros.nodes import images
from compass_ros.nodes.play import AXES, ArmSample
from compass_ros.tracking.arm import arm_pose
from compass_ros.tracking.frames import Place
from compass_ros.tracking.scene_config import ArmConfig
from compass_ros.types import Floats

LINKS = ("shoulder", "elbow")
TOOL_FRAME = "tool"
_QOS = QoSProfile(depth=1000)
"""Reliable; several seconds of readings wait for a subscriber that is held up. They come some at a time."""


class VirtualArm:
    """Publishes for a node: `~/joint_states`, `~/joint_commands`, `~/tool_pose` and the tool's frame in /tf."""

    def __init__(self, node: Node, table: str, drawn: ArmConfig | None, step_m: float) -> None:
        """`table`: frame of the table; `step_m`: what the encoders of the tool's axes count in."""
        self._table, self._drawn, self._step = table, drawn, step_m
        self._states = node.create_publisher(JointState, "~/joint_states", _QOS)
        self._commands = node.create_publisher(JointState, "~/joint_commands", _QOS)
        self._poses = node.create_publisher(PoseStamped, "~/tool_pose", _QOS)
        self._frames = node.create_publisher(TFMessage, "/tf", _QOS)

    def publish(self, samples: Sequence[ArmSample], end_ns: int) -> None:
        """Samples in the order of their time before the stamp `end_ns`."""
        for sample in samples:
            at_ns = end_ns - round(sample.before_s * 1e9)
            self._say(sample, at_ns, sample.counted(self._step))

    def _say(self, sample: ArmSample, at_ns: int, tool: Floats) -> None:
        if _heard(self._states):
            self._states.publish(images.joint_message(self._joints(tool), images.header(at_ns, "")))
        if _heard(self._commands):
            told = JointState(header=images.header(at_ns, ""), name=list(AXES), velocity=sample.told.tolist())
            self._commands.publish(told)
        x, y = tool.tolist()
        head = images.header(at_ns, self._table)
        if _heard(self._poses):
            pose = Pose(position=Point(x=x, y=y), orientation=Quaternion(w=1.0))
            self._poses.publish(PoseStamped(header=head, pose=pose))
        if _heard(self._frames):
            place = Place(np.eye(3), np.array([x, y, 0.0]))
            frame = images.transform_message(place, self._table, TOOL_FRAME, head.stamp)
            self._frames.publish(TFMessage(transforms=[frame]))

    def _joints(self, tool: Floats) -> dict[str, float]:
        axes = dict(zip(AXES, tool.tolist(), strict=True))
        if self._drawn is None:
            return axes
        return dict(zip(LINKS, arm_pose(self._drawn, tool).joints.tolist(), strict=True)) | axes


def _heard(topic: Publisher) -> bool:
    return bool(topic.get_subscription_count())

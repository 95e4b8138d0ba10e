"""What tests of the recorder send."""

from __future__ import annotations

from geometry_msgs.msg import PoseWithCovarianceStamped

from test.episodes.planted import PUCK1

TOPIC = PUCK1[0].topic


def pose(number: int) -> PoseWithCovarianceStamped:
    """Pose number n, whose x is n, at n ms."""
    message = PoseWithCovarianceStamped()
    message.header.frame_id = "table_frame"  # 11 letters: no padding, which ROS leaves uninitialised
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(10**9 + number * 10**6, 10**9)
    message.pose.pose.position.x = float(number)
    message.pose.covariance[0] = message.pose.covariance[7] = 1e-6
    return message

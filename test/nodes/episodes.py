"""What tests of the recorder send, and how they ask."""

from __future__ import annotations

import time
from typing import Any

from geometry_msgs.msg import PoseWithCovarianceStamped

from test.episodes.planted import PUCK1
from test.nodes.harness import Probe

TOPIC = PUCK1[0].topic
ANSWER_S = 0.2


def pose(number: int) -> PoseWithCovarianceStamped:
    """Pose number n, whose x is n, at n ms."""
    message = PoseWithCovarianceStamped()
    message.header.frame_id = "table_frame"  # 11 letters: no padding, which ROS leaves uninitialised
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(10**9 + number * 10**6, 10**9)
    message.pose.pose.position.x = float(number)
    message.pose.covariance[0] = message.pose.covariance[7] = 1e-6
    return message


def timed(probe: Probe, kind: Any, service: str, request: Any = None) -> Any:
    """The answer of a service, which must come in time; the client is connected before the clock runs."""
    client = probe.node.create_client(kind, service)
    assert client.wait_for_service(10), service
    before = time.monotonic()
    answer = probe.result(client.call_async(request or kind.Request()))
    assert time.monotonic() - before < ANSWER_S, f"{service} took {time.monotonic() - before:.3f} s"
    return answer

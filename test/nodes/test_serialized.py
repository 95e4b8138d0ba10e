"""Bytes as `serialize_message` gives them, which scripts write into bags: with what was reserved for them behind."""

from __future__ import annotations

from array import array
from typing import Any

import numpy as np
import pytest
from builtin_interfaces.msg import Duration
from geometry_msgs.msg import Twist
from rclpy.serialization import serialize_message
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Float64MultiArray
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from compass_ros.episodes.layout import layout, matrix
from compass_ros.episodes.raw import RawTopic
from compass_ros.episodes.schemas import fields_of
from compass_ros.errors import BagError

pytestmark = pytest.mark.ros

NAMES = ["a", "long_name"]
POINT = JointTrajectoryPoint(positions=[1.0, 2.0], time_from_start=Duration(sec=3))

CASES: dict[str, tuple[Any, dict[str, list[int]]]] = {
    "positions alone": (
        JointState(name=NAMES, position=[1.0, 2.0]),
        {"position": [1, 2], "velocity": [], "effort": []},
    ),
    "velocities alone": (JointState(name=NAMES, velocity=[1.0, 2.0]), {"velocity": [1, 2]}),
    "efforts alone": (JointState(name=NAMES, effort=[1.0, 2.0]), {"position": [], "effort": [1, 2]}),
    "no numbers": (JointState(name=["abc"]), {"position": [], "velocity": [], "effort": []}),
    "all": (JointState(name=["a"], position=[1.0], velocity=[2.0], effort=[3.0]), {"effort": [3]}),
    "points": (
        JointTrajectory(joint_names=NAMES, points=[POINT] * 5),
        {f"points[{i}].positions": [1, 2] for i in range(5)} | {"points[4].time_from_start.sec": [3]},
    ),
    "an empty array": (Float64MultiArray(), {"data": []}),
    "numbers": (Float64MultiArray(data=array("d", [1.0, 2.0])), {"data": [1, 2]}),
    "no arrays": (Twist(), {"linear.x": [0]}),
    "fixed arrays": (Imu(), {"orientation_covariance": [0] * 9}),
}


@pytest.mark.parametrize("name", CASES)
def test_what_is_behind_a_message_is_left_alone(name: str) -> None:
    message, expected = CASES[name]
    kind = type(message)
    type_name = f"{kind.__module__.partition('.')[0]}/msg/{kind.__name__}"
    data = serialize_message(message)
    found = layout(fields_of(RawTopic("/x", type_name)), type_name, data)
    for path, numbers in expected.items():
        assert found.count(path) == len(numbers)
        assert not numbers or found.places[path].of(matrix([data]))[0].tolist() == numbers
    with pytest.raises(BagError, match="bytes are left over"):
        layout(fields_of(RawTopic("/x", type_name)), type_name, data + bytes(np.full(200, 1, np.uint8)))

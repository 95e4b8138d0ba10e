"""Definitions of messages that rosbags lacks: of ros2_control, as released for Humble and Jazzy, and made up."""

from __future__ import annotations

from functools import cache

from rosbags.interfaces.typing import Typesdict
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

_POINT = "trajectory_msgs/JointTrajectoryPoint"
_MULTI = "trajectory_msgs/MultiDOFJointTrajectoryPoint"


def _controller_state(*parts: str, end: str = "") -> str:
    lines = ["std_msgs/Header header", "string[] joint_names", *(f"{_POINT} {part}" for part in parts)]
    lines += ["string[] multi_dof_joint_names", *(f"{_MULTI} multi_dof_{part}" for part in parts), end]
    return "\n".join(lines) + "\n"


STATE = "control_msgs/msg/JointTrajectoryControllerState"
HUMBLE = {
    STATE: _controller_state("reference", "feedback", "error", "output", "desired", "actual"),
}
JAZZY = {
    STATE: _controller_state("reference", "feedback", "error", "output", end="float64 speed_scaling_factor"),
    "control_msgs/msg/InterfaceValue": "string[] interface_names\nfloat64[] values\n",
    "control_msgs/msg/DynamicJointState": """\
# State of joints with any interfaces
std_msgs/Header header
string[] joint_names
InterfaceValue[] interface_values
""",
    "control_msgs/msg/SingleDOFState": """\
string name
float64 reference
float64 feedback
float64 feedback_dot
float64 error
float64 error_dot
float64 time_step
float64 output
""",
    "control_msgs/msg/SingleDOFStateStamped": "std_msgs/Header header\nSingleDOFState dof_state\n",
    "control_msgs/msg/MultiDOFStateStamped": "std_msgs/Header header\nSingleDOFState[] dof_states\n",
    "control_msgs/msg/MultiDOFCommand": "string[] dof_names\nfloat64[] values\nfloat64[] values_dot\n",
    "vendor_msgs/msg/Motor": "uint8 mode\nfloat32 q\nfloat32 dq\nfloat32 tau_est\nint8 temperature\n",
    "vendor_msgs/msg/LowState": """\
uint8[2] head
uint8 LEVEL=1
Motor[3] motors
float32[4] quaternion
float64[] foot_force
bool ok
""",
    "vendor_msgs/msg/Nothing": "# nothing\n",
    "vendor_msgs/msg/Drive": """\
std_msgs/Header header
Nothing reserved
int16 status 3
string<=20 label "x"
float64 current
""",
}


@cache
def others(distribution: str = "jazzy") -> Typestore:
    """The standard types and those above, as rosbags holds them."""
    store = get_typestore(Stores.ROS2_HUMBLE if distribution == "humble" else Stores.ROS2_JAZZY)
    types: Typesdict = {}
    for name, text in (JAZZY | (HUMBLE if distribution == "humble" else {})).items():
        types |= get_types_from_msg(text, name)
    store.register(types)
    return store

"""The suite on a robot: the only folder that knows ROS. A node declares, subscribes, converts, calls, publishes."""

from importlib.util import find_spec

from compass_ros.extras import advice

INTERFACES = "compass_ros_interfaces"
MISSING = {
    "rclpy": "ROS 2 is not here: . /opt/ros/jazzy/setup.bash, or `make install` where there is no ROS",
    INTERFACES: (
        f"its messages ({INTERFACES}) are not built: in the workspace, run: "
        f"ln -s compass_ros/msg_schemas src/{INTERFACES} && colcon build && . install/setup.bash"
        " (without colcon: make install)"
    ),
}
"""What a node cannot do without, and what to run where it is not there."""

if find_spec("cv2") is None:
    raise SystemExit(f"compass_ros: {advice('cv2')}")
for _name, _what in MISSING.items():
    if find_spec(_name) is None:
        raise SystemExit(f"compass_ros: {_what}")

"""Libraries that only some commands need, and the extra of the package that brings each."""

from __future__ import annotations

EXTRAS = {
    "cv2": "track",
    "domain_coordinator": "ros",
    "matplotlib": "report",
    "numba": "bench",
    "pyarrow": "parquet",
    "pysindy": "rivals",
    "rclpy": "ros",
    "ray": "ray",
    "robosuite": "bench",
    "sbi": "rivals",
    "sklearn": "rivals",
    "torch": "policy",
}
"""By the name that is imported. Those of ROS come from apt, or from requirements.lock (docs/install.md)."""
OF_ROS = ("domain_coordinator", "rclpy")


def advice(module: str) -> str:
    """What to do where this library is not there: one line."""
    if module in OF_ROS:
        return f"needs ROS 2 ({module}): . /opt/ros/jazzy/setup.bash, or `make install` where there is no ROS"
    return f"needs {module}, which is not installed: pip install 'compass_ros[{EXTRAS[module]}]'"


def what_to_install(error: ModuleNotFoundError) -> str | None:
    """One line for a library of an extra; None for any other one, which is a fault of ours."""
    module = (error.name or "").partition(".")[0]
    return advice(module) if module in EXTRAS else None

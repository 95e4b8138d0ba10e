"""The suite on the virtual cell, which stands where the robot and the camera stand.

    ros2 launch compass_ros virtual_cell.launch.py
    ros2 run compass_ros shooter --ros-args -p shots_file:=out/demo/demo.yaml

Each node has one YAML of parameters in config/, which an argument can replace. Ctrl-C ends all, and so does
the end of any one of them: a node that cannot start, or that dies, leaves no half of a cell behind.
"""

from launch.actions import DeclareLaunchArgument, SetEnvironmentVariable, Shutdown
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

from launch import LaunchDescription

FRAMED = ("virtual_cell", "puck_tracker", "calibrator")
NODES = ("virtual_cell", "puck_tracker", "recorder", "calibrator")


def generate_launch_description() -> LaunchDescription:
    config = PathJoinSubstitution([FindPackageShare("compass_ros"), "config"])
    arguments = [
        DeclareLaunchArgument("namespace", default_value="", description="namespace of all nodes"),
        DeclareLaunchArgument("frame", default_value="table", description="frame of the table, in messages and in TF"),
        DeclareLaunchArgument("use_sim_time", default_value="false", description="take the time from /clock"),
    ]
    arguments += [
        DeclareLaunchArgument(
            f"{name}_parameters",
            default_value=PathJoinSubstitution([config, f"{name}.yaml"]),
            description=f"YAML with the parameters of {name}",
        )
        for name in NODES
    ]
    nodes = [
        Node(
            package="compass_ros",
            executable=name,
            name=name,
            namespace=LaunchConfiguration("namespace"),
            parameters=[
                LaunchConfiguration(f"{name}_parameters"),
                {"use_sim_time": LaunchConfiguration("use_sim_time")},
                *([{"frame": LaunchConfiguration("frame")}] if name in FRAMED else []),
            ],
            output="screen",
            on_exit=Shutdown(reason=f"{name} has ended"),
        )
        for name in NODES
    ]
    # Camera images are larger than the default shared-memory segment of Fast DDS.
    profile = SetEnvironmentVariable("FASTRTPS_DEFAULT_PROFILES_FILE", PathJoinSubstitution([config, "fastdds.xml"]))
    return LaunchDescription([*arguments, profile, *nodes])

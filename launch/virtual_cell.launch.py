"""The suite on the virtual cell, which stands where the robot and the camera stand.

    ros2 launch compass_ros virtual_cell.launch.py
    ros2 run compass_ros shooter --ros-args -p shots_file:=out/demo/demo.yaml

Each node has one YAML of parameters in config/, which an argument can replace. Ctrl-C ends all.
"""

from launch.actions import DeclareLaunchArgument, SetEnvironmentVariable
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

from launch import LaunchDescription

NODES = ("virtual_cell", "puck_tracker", "recorder", "calibrator")


def generate_launch_description() -> LaunchDescription:
    config = PathJoinSubstitution([FindPackageShare("compass_ros"), "config"])
    arguments = [
        DeclareLaunchArgument("namespace", default_value="", description="namespace of all nodes"),
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
            ],
            output="screen",
        )
        for name in NODES
    ]
    # Camera images are larger than the default shared-memory segment of Fast DDS.
    profile = SetEnvironmentVariable("FASTRTPS_DEFAULT_PROFILES_FILE", PathJoinSubstitution([config, "fastdds.xml"]))
    return LaunchDescription([*arguments, profile, *nodes])

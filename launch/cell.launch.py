"""The suite on a real cell with a RealSense camera over the table.

    ros2 launch realsense2_camera rs_launch.py rgb_camera.color_profile:=640x480x60
    ros2 launch compass_ros cell.launch.py

The camera's topics are named as realsense2_camera names them; the arguments `image` and `camera_info` take others. The
robot's driver publishes a compass_ros_interfaces/ShotCommand, stamped with the moment the motion begins, on a topic
that config/recorder.yaml lists. Each node has one YAML of parameters, which an argument can replace. Ctrl-C ends all,
and so does the end of any one of them: a node that cannot start, or that dies, leaves no half of a cell behind.
"""

from launch.actions import DeclareLaunchArgument, SetEnvironmentVariable, Shutdown
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

from launch import LaunchDescription

NODES = ("puck_tracker", "recorder", "calibrator")
FRAMED = ("puck_tracker", "calibrator")
PROMPT = ("puck_tracker", "recorder")
CAMERA = {"image": "/camera/camera/color/image_raw", "camera_info": "/camera/camera/color/camera_info"}
TABLE = {"x": "0", "y": "0", "z": "0", "yaw": "0", "pitch": "0", "roll": "0"}


def generate_launch_description() -> LaunchDescription:
    config = PathJoinSubstitution([FindPackageShare("compass_ros"), "config"])
    arguments = [
        DeclareLaunchArgument("namespace", default_value="", description="namespace of all nodes"),
        DeclareLaunchArgument("frame", default_value="table", description="frame of the table, in messages and in TF"),
        DeclareLaunchArgument("use_sim_time", default_value="false", description="take the time from /clock"),
        DeclareLaunchArgument(
            "prefix", default_value="", description="before the commands of tracker and recorder: 'chrt --fifo 20'"
        ),
        DeclareLaunchArgument("world", default_value="world", description="frame in which the table stands"),
    ]
    arguments += [
        DeclareLaunchArgument(
            f"{name}_parameters",
            default_value=PathJoinSubstitution([config, f"{name}.yaml"]),
            description=f"YAML with the parameters of {name}",
        )
        for name in NODES
    ]
    arguments += [
        DeclareLaunchArgument(name, default_value=topic, description=f"topic of the camera's {name}")
        for name, topic in CAMERA.items()
    ]
    arguments += [
        DeclareLaunchArgument(f"table_{name}", default_value=value, description=f"{name} of the table in `world`")
        for name, value in TABLE.items()
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
            remappings=[(topic, LaunchConfiguration(topic)) for topic in CAMERA] if name == "puck_tracker" else [],
            prefix=LaunchConfiguration("prefix") if name in PROMPT else None,
            output="screen",
            on_exit=Shutdown(reason=f"{name} has ended"),
        )
        for name in NODES
    ]
    place = [word for name in TABLE for word in (f"--{name}", LaunchConfiguration(f"table_{name}"))]
    table = Node(
        package="tf2_ros",
        executable="static_transform_publisher",
        name="table_in_world",
        namespace=LaunchConfiguration("namespace"),
        arguments=[
            *place,
            "--frame-id",
            LaunchConfiguration("world"),
            "--child-frame-id",
            LaunchConfiguration("frame"),
        ],
        on_exit=Shutdown(reason="the transform of the table has ended"),
    )
    # Camera images are larger than the default shared-memory segment of Fast DDS.
    profile = SetEnvironmentVariable("FASTRTPS_DEFAULT_PROFILES_FILE", PathJoinSubstitution([config, "fastdds.xml"]))
    return LaunchDescription([*arguments, profile, *nodes, table])

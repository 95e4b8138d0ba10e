"""Bags of other people: written by rosbags, not by this package."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter
from rosbags.interfaces import Connection
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys.store import Typestore

from compass_ros.episodes import Source
from compass_ros.episodes.definitions import ros1_typestore, typestore

FRAMES = 20
STAMPS = [1_650_000_000_000_000_000 + frame * 10_000_000 for frame in range(FRAMES)]
POSITION = np.random.default_rng(7).normal(size=(FRAMES, 3))
TURN = (0.5, 0.1, -0.7, 0.2)
"""w, x, y, z"""

SOURCES = (
    Source("/pose", "a", "pose"),
    Source("/pose_cov", "b", "xy"),
    Source("/point", "c", "xyz"),
    Source("/transform", "d", "pose"),
    Source("/tf", "e", "xyz", entry="second"),
    Source("/odom", "f", "xy"),
    Source("/joints", "g", "joint", entry="elbow"),
)


def messages(store: Typestore, frame: int) -> list[tuple[str, str, object]]:
    """(topic, type, message) of one frame: everything at POSITION[frame], one message of a type nobody knows."""
    t = store.types
    x, y, z = (float(v) for v in POSITION[frame])
    stamp = t["builtin_interfaces/msg/Time"](sec=STAMPS[frame] // 10**9, nanosec=STAMPS[frame] % 10**9)
    seq = {"seq": frame} if any(name == "seq" for name, _ in store.fielddefs["std_msgs/msg/Header"][1]) else {}
    header = t["std_msgs/msg/Header"](stamp=stamp, frame_id="world", **seq)
    point = t["geometry_msgs/msg/Point"](x=x, y=y, z=z)
    vector = t["geometry_msgs/msg/Vector3"](x=x, y=y, z=z)
    turn = t["geometry_msgs/msg/Quaternion"](w=TURN[0], x=TURN[1], y=TURN[2], z=TURN[3])
    pose = t["geometry_msgs/msg/Pose"](position=point, orientation=turn)
    stated = t["geometry_msgs/msg/PoseWithCovariance"](pose=pose, covariance=np.eye(6).ravel() * 4e-6)
    twist = t["geometry_msgs/msg/Twist"](linear=vector, angular=vector)
    moving = t["geometry_msgs/msg/TwistWithCovariance"](twist=twist, covariance=np.zeros(36))
    transform = t["geometry_msgs/msg/Transform"](translation=vector, rotation=turn)

    def stamped(child: str) -> object:
        return t["geometry_msgs/msg/TransformStamped"](header=header, child_frame_id=child, transform=transform)

    frames: list[object] = [stamped("first"), stamped("second")]
    angles = np.array([0.0, x])
    none = np.zeros(0)
    return [
        ("/pose", "geometry_msgs/msg/PoseStamped", t["geometry_msgs/msg/PoseStamped"](header=header, pose=pose)),
        (
            "/pose_cov",
            "geometry_msgs/msg/PoseWithCovarianceStamped",
            t["geometry_msgs/msg/PoseWithCovarianceStamped"](header=header, pose=stated),
        ),
        ("/point", "geometry_msgs/msg/PointStamped", t["geometry_msgs/msg/PointStamped"](header=header, point=point)),
        ("/transform", "geometry_msgs/msg/TransformStamped", stamped("anything")),
        ("/tf", "tf2_msgs/msg/TFMessage", t["tf2_msgs/msg/TFMessage"](transforms=frames)),  # type: ignore[arg-type]
        (
            "/odom",
            "nav_msgs/msg/Odometry",
            t["nav_msgs/msg/Odometry"](header=header, child_frame_id="base", pose=stated, twist=moving),
        ),
        (
            "/joints",
            "sensor_msgs/msg/JointState",
            t["sensor_msgs/msg/JointState"](
                header=header, name=["shoulder", "elbow"], position=angles, velocity=none, effort=none
            ),
        ),
        ("/text", "std_msgs/msg/String", t["std_msgs/msg/String"](data=f"frame {frame}")),
    ]


def write_rosbag2(
    folder: Path,
    storage: StoragePlugin,
    frames: Iterable[int] = range(FRAMES),
    compression: CompressionMode = CompressionMode.NONE,
) -> Path:
    store = typestore()
    writer = Writer2(folder, version=9, storage_plugin=storage)
    writer.set_compression(compression, CompressionFormat.ZSTD)
    with writer:
        known: dict[str, Connection] = {}
        for frame in frames:
            for topic, kind, message in messages(store, frame):
                if topic not in known:
                    known[topic] = writer.add_connection(topic, kind, typestore=store)
                writer.write(known[topic], STAMPS[frame], store.serialize_cdr(message, kind))
    return folder


def write_ros1(path: Path, compression: Writer1.CompressionFormat | None = None) -> Path:
    store = ros1_typestore()
    writer = Writer1(path)
    if compression is not None:
        writer.set_compression(compression)
    with writer:
        known: dict[str, Connection] = {}
        for frame in range(FRAMES):
            for topic, kind, message in messages(store, frame):
                if topic not in known:
                    known[topic] = writer.add_connection(topic, kind, typestore=store)
                writer.write(known[topic], STAMPS[frame], store.serialize_ros1(message, kind))
    return path


def write_ros1_mcap(path: Path, compression: CompressionType = CompressionType.ZSTD) -> Path:
    """As `mcap convert old.bag new.mcap` writes it: the messages of ROS 1, and the names of their types."""
    store = ros1_typestore()
    with path.open("wb") as file:
        writer = McapWriter(file, compression=compression)
        writer.start(profile="ros1", library="mcap go")
        known: dict[str, int] = {}
        for frame in range(FRAMES):
            for topic, kind, message in messages(store, frame):
                if topic not in known:
                    text, md5 = store.generate_msgdef(kind)
                    schema = writer.register_schema(kind.replace("/msg/", "/"), "ros1msg", text.encode())
                    metadata = {"callerid": "/other", "latching": "0", "md5sum": md5}
                    known[topic] = writer.register_channel(topic, "ros1", schema, metadata)
                data = bytes(store.serialize_ros1(message, kind))
                writer.add_message(known[topic], STAMPS[frame], data, STAMPS[frame], frame)
        writer.finish()  # type: ignore[no-untyped-call]
    return path


def all_bags(folder: Path) -> Sequence[Path]:
    """The same recording in every format."""
    return [
        write_rosbag2(folder / "mcap", StoragePlugin.MCAP),
        write_rosbag2(folder / "sqlite3", StoragePlugin.SQLITE3),
        write_rosbag2(folder / "mcap_file", StoragePlugin.MCAP, compression=CompressionMode.FILE),
        write_rosbag2(folder / "mcap_message", StoragePlugin.MCAP, compression=CompressionMode.MESSAGE),
        write_rosbag2(folder / "mcap_storage", StoragePlugin.MCAP, compression=CompressionMode.STORAGE),
        write_rosbag2(folder / "sqlite3_file", StoragePlugin.SQLITE3, compression=CompressionMode.FILE),
        write_rosbag2(folder / "sqlite3_message", StoragePlugin.SQLITE3, compression=CompressionMode.MESSAGE),
        write_ros1(folder / "plain.bag"),
        write_ros1(folder / "bz2.bag", Writer1.CompressionFormat.BZ2),
        write_ros1(folder / "lz4.bag", Writer1.CompressionFormat.LZ4),
        write_ros1_mcap(folder / "ros1_plain.mcap", CompressionType.NONE),
        write_ros1_mcap(folder / "ros1_lz4.mcap", CompressionType.LZ4),
        write_ros1_mcap(folder / "ros1_zstd.mcap", CompressionType.ZSTD),
    ]


FORMATS = (
    "mcap", "sqlite3", "mcap-file", "mcap-message", "mcap-storage", "sqlite3-file", "sqlite3-message",
    "ros1", "ros1-bz2", "ros1-lz4", "ros1-in-mcap", "ros1-in-mcap-lz4", "ros1-in-mcap-zstd",
)  # fmt: skip
"""Of `all_bags`."""

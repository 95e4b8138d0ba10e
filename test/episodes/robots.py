"""Logs of robots as others write them: by rosbags in both storages, and by mcap_ros2."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from mcap_ros2.writer import Writer as Mcap2Writer
from numpy.typing import ArrayLike, NDArray
from rosbags.interfaces import Connection
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys.store import Typestore

from test.episodes.definitions_of_others import others

START = 1_700_000_000_000_000_000
MS = 10**6
JOINTS = ("lift", "elbow", "wrist")
FRAMES = 12
STAMPS = START + 5 * MS * np.arange(FRAMES)
PLANTED = np.random.default_rng(5).normal(size=(3, FRAMES, 3))
"""Positions, velocities, efforts of the joints."""
POSITION = PLANTED[0]

Logged = tuple[str, int, Any]
"""Topic, log time [ns], message of rosbags."""


def header(store: Typestore, at_ns: int, frame: str = "") -> Any:
    at_ns = int(at_ns)
    stamp = store.types["builtin_interfaces/msg/Time"](sec=at_ns // 10**9, nanosec=at_ns % 10**9)
    return store.types["std_msgs/msg/Header"](stamp=stamp, frame_id=frame)


def joint_state(
    store: Typestore,
    at_ns: int,
    names: Sequence[str],
    position: ArrayLike = (),
    velocity: ArrayLike = (),
    effort: ArrayLike = (),
    frame: str = "",
) -> Any:
    numbers = [np.array(given, float) for given in (position, velocity, effort)]
    return store.types["sensor_msgs/msg/JointState"](header(store, at_ns, frame), list(names), *numbers)


def point(store: Typestore, since_ns: int = 0, **numbers: ArrayLike) -> Any:
    since = store.types["builtin_interfaces/msg/Duration"](sec=since_ns // 10**9, nanosec=since_ns % 10**9)
    every = [np.array(numbers.get(name, ()), float) for name in ("positions", "velocities", "accelerations", "effort")]
    return store.types["trajectory_msgs/msg/JointTrajectoryPoint"](*every, since)


def vector(store: Typestore, numbers: Iterable[float]) -> Any:
    return store.types["geometry_msgs/msg/Vector3"](*map(float, numbers))


def array(store: Typestore, numbers: NDArray[np.float64], kind: str = "Float64MultiArray") -> Any:
    layout = store.types["std_msgs/msg/MultiArrayLayout"]([], 0)
    return store.types[f"std_msgs/msg/{kind}"](layout, numbers.astype(kind.removesuffix("MultiArray").lower()))


def write(folder: Path, logged: Sequence[Logged], store: Typestore | None = None, storage: str = "mcap") -> Path:
    """A bag by rosbags' writer, `mcap` or `sqlite3`; or a file by mcap_ros2's, `mcap_ros2`."""
    store = store or others()
    if storage == "mcap_ros2":
        return _by_mcap_ros2(folder.with_suffix(".mcap"), logged, store)
    plugin = StoragePlugin.MCAP if storage == "mcap" else StoragePlugin.SQLITE3
    with Writer(folder, version=9, storage_plugin=plugin) as writer:
        known: dict[tuple[str, str], Connection] = {}
        for topic, log_ns, message in logged:
            kind = str(message.__msgtype__)
            if (topic, kind) not in known:
                known[topic, kind] = writer.add_connection(topic, kind, typestore=store)
            writer.write(known[topic, kind], int(log_ns), store.serialize_cdr(message, kind))
    return folder


def _by_mcap_ros2(path: Path, logged: Sequence[Logged], store: Typestore) -> Path:
    with path.open("wb") as file:
        writer = Mcap2Writer(file)
        schemas: dict[str, Any] = {}
        for topic, log_ns, message in logged:
            kind = str(message.__msgtype__)
            if kind not in schemas:
                text, _ = store.generate_msgdef(kind, ros_version=2)
                schemas[kind] = writer.register_msgdef(kind, text)
            writer.write_message(topic, schemas[kind], plain(message), int(log_ns), int(log_ns))
        writer.finish()
    return path


def plain(value: Any) -> Any:
    """A message of rosbags as mcap_ros2 takes it."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, list):
        return [plain(one) for one in value]
    if isinstance(value, bool | int | float | str):
        return value
    fields: Mapping[str, Any] = {n: v for n, v in vars(value).items() if not n.startswith("__") and not n.isupper()}
    return {name: plain(one) for name, one in fields.items()}

"""How fast a long log is read, and in how much memory: JointState of seven joints at 1 kHz, written by rosbags.

    python benchmarks/reading.py [--messages 600000] [--bag FOLDER]

Positions, velocities and efforts of all joints are read. Time is that of the processor, and in brackets of the clock on
the wall; memory is the most that the process held beyond what it held before.
"""

from __future__ import annotations

import argparse
import resource
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from compass_ros.episodes import Source, read_bag
from compass_ros.types import Quantity

JOINTS = tuple(f"panda_joint{i}" for i in range(1, 8))
KIND = "sensor_msgs/msg/JointState"
START_NS = 1_700_000_000_000_000_000
QUANTITIES: tuple[Quantity, ...] = ("joint_position", "joint_velocity", "joint_effort")


def write(folder: Path, count: int) -> None:
    store, rng = get_typestore(Stores.ROS2_JAZZY), np.random.default_rng(0)
    types = store.types
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connection = writer.add_connection("/joint_states", KIND, typestore=store)
        for i in range(count):
            at = START_NS + i * 1_000_000
            stamp = types["builtin_interfaces/msg/Time"](at // 10**9, at % 10**9)
            numbers = rng.normal(size=(3, 7))
            message = types[KIND](types["std_msgs/msg/Header"](stamp, ""), list(JOINTS), *numbers)
            writer.write(connection, at, store.serialize_cdr(message, KIND))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--messages", type=int, default=600_000)
    parser.add_argument("--bag", type=Path, help="where the bag is, or is made and kept")
    arguments = parser.parse_args()
    with TemporaryDirectory() as folder:
        bag = arguments.bag or Path(folder, "log")
        if not bag.exists():
            write(bag, arguments.messages)
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        wall, processor = time.perf_counter(), time.process_time()
        sources = [Source("/joint_states", quantity, quantity, of=JOINTS) for quantity in QUANTITIES]
        found = read_bag(bag, sources).episode
        processor, wall = time.process_time() - processor, time.perf_counter() - wall
        rows = len(found.tracks[0].stamp_ns)
        held = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
    print(f"{rows} messages of 3 x {len(JOINTS)} numbers: {processor:.1f} s ({wall:.1f} s), {held:.0f} MB")


if __name__ == "__main__":
    main()

"""A two-joint arm as it moves, recorded under whatever names and in whatever messages somebody else chose."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import mujoco
import numpy as np
from rosbags.typesys.stores import ros2_jazzy as ros

from compass_ros.episodes import Source, write_episode
from compass_ros.episodes.definitions import embedded_definition
from compass_ros.episodes.notes import encoded, stamped
from compass_ros.episodes.writer import BagWriter
from compass_ros.types import Episode, Floats, Ints, Track

START_NS = 1_700_000_000_000_000_000
DRIVES = """<actuator><position name="{0}" joint="{0}" kp="60" kv="4"/>
<position name="{1}" joint="{1}" kp="30" kv="2"/></actuator>"""
ARM = """<mujoco model="arm"><option timestep="0.002" integrator="implicitfast"/><worldbody>
<body name="upper"><inertial pos="0 0 0.15" mass="1" diaginertia="0.01 0.01 0.001"/>
<joint name="{0}" axis="0 1 0" damping="0.5" frictionloss="{loss}" armature="0.05"/>
<body name="lower" pos="0 0 0.3"><inertial pos="0 0 0.1" mass="0.5" diaginertia="0.004 0.004 0.0005"/>
<joint name="{1}" axis="0 1 0" damping="0.3" armature="0.02"/></body></body>
<body name="red_cube" pos="1 0 0"><freejoint/><geom name="cube" size="0.02" type="sphere" mass="0.1"/></body>
</worldbody>{drives}</mujoco>"""
URDF = """<robot name="two"><link name="base"><visual><geometry><mesh filename="package://two/base.dae"/></geometry></visual>
</link><link name="upper"><inertial><origin xyz="0 0 0.15"/><mass value="1"/>
<inertia ixx="0.01" iyy="0.01" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><mesh filename="package://two/upper.stl"/></geometry></collision></link>
<link name="lower"><inertial><origin xyz="0 0 0.1"/><mass value="0.5"/>
<inertia ixx="0.004" iyy="0.004" izz="0.0005" ixy="0" ixz="0" iyz="0"/></inertial>
<collision><geometry><mesh filename="package://two/lower.stl"/></geometry></collision></link>
<joint name="{0}" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
<limit lower="-2" upper="2" effort="20" velocity="3"/><dynamics damping="0.5" friction="0.2"/></joint>
<joint name="{1}" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0 0 0.3"/><axis xyz="0 1 0"/>
<limit lower="-2" upper="2" effort="20" velocity="3"/><dynamics damping="0.3" friction="0"/></joint></robot>"""


def mjcf(first: str = "shoulder", second: str = "elbow", driven: bool = True, loss: float = 0.2) -> str:
    return ARM.format(first, second, loss=loss, drives=DRIVES.format(first, second) if driven else "")


def command(seed: int, seconds: float, rate_hz: float = 50.0) -> tuple[Floats, Floats]:
    """(n,) times and (n, 2) targets: sines of other frequencies for each joint, not much correlated."""
    rng = np.random.default_rng(seed)
    time = np.arange(0, seconds, 1 / rate_hz)
    low = rng.uniform(0.25, 0.4, 2) * [1.0, 1.7]
    waves = np.sin(2 * np.pi * np.multiply.outer(time, low) + rng.uniform(0, 6, 2))
    fast = np.sin(2 * np.pi * np.multiply.outer(time, 2.3 * low) + rng.uniform(0, 6, 2))
    return time, np.asarray(0.4 * waves + 0.15 * fast)


def moved(seed: int, seconds: float, late_s: float = 0.0) -> tuple[Floats, Floats, Floats]:
    """(n,) times, (n, 2) targets and (n, 2) what the arm did, its targets late, noise of 0.5 mrad on it."""
    time, target = command(seed, seconds)
    model = mujoco.MjModel.from_xml_string(mjcf())
    data, out = mujoco.MjData(model), np.zeros(target.shape)
    data.qpos[:2] = data.ctrl[:] = target[0]
    for _ in range(500):
        mujoco.mj_step(model, data)
    data.time = 0.0
    for i, now in enumerate(time):
        while data.time < now - 1e-9:
            data.ctrl[:] = target[max(np.searchsorted(time, data.time - late_s + 1e-9, side="right") - 1, 0)]
            mujoco.mj_step(model, data)
        out[i] = data.qpos[:2]
    return time, target, out + np.random.default_rng(seed + 99).normal(0, 0.0005, out.shape)


def stamps(time: Floats, seed: int) -> Ints:
    return np.asarray(START_NS + seed * 10**12 + np.round(time * 1e9).astype(np.int64))


def record(folder: Path, seed: int, tracks: Sequence[tuple[Track, Source]], cell: str = "") -> None:
    """A bag with these series, which may say whose it is."""
    signals, inputs = ([t for t, s in tracks if s.drives == drives] for drives in (False, True))
    first = int(tracks[0][0].stamp_ns[0])
    said = Episode(f"run{seed}", cell, "", {}, first, tuple(signals), inputs=tuple(inputs))
    write_episode(said, folder, [s for _, s in tracks])


def state(name: str, topic: str, of: Sequence[str], stamp: Ints, value: Floats) -> tuple[Track, Source]:
    """Positions in JointState."""
    return Track(name, "joint_position", stamp, np.ascontiguousarray(value)), Source(
        topic, name, "joint_position", of=tuple(of)
    )


def write_trajectories(folder: Path, seed: int, of: Sequence[str], time: Floats, target: Floats, got: Floats) -> None:
    """JointState, and the targets as one JointTrajectory for each second, with a point every 0.1 s."""
    writer = BagWriter(folder / f"run{seed}")
    kinds = {"/joint_states": "sensor_msgs/msg/JointState", "/arm_controller/joint_trajectory":
             "trajectory_msgs/msg/JointTrajectory"}  # fmt: skip
    channels = {topic: writer.add_topic(topic, embedded_definition(kind)) for topic, kind in kinds.items()}
    none = np.zeros(0)
    for i, stamp in enumerate(stamps(time, seed).tolist()):
        if i % 50 == 0:
            points = [
                ros.trajectory_msgs__msg__JointTrajectoryPoint(
                    target[j], none, none, none, ros.builtin_interfaces__msg__Duration(0, round((j - i) * 2e7))
                )
                for j in range(i, min(i + 50, len(time)), 5)
            ]
            asked = ros.trajectory_msgs__msg__JointTrajectory(stamped(stamp), list(of), points)
            data = encoded(asked, kinds["/arm_controller/joint_trajectory"])
            writer.write(channels["/arm_controller/joint_trajectory"], stamp, stamp, data)
        said = ros.sensor_msgs__msg__JointState(stamped(stamp), list(of), got[i], none, none)
        writer.write(channels["/joint_states"], stamp, stamp, encoded(said, kinds["/joint_states"]))
    writer.close()

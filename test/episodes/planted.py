"""Episodes and bags whose content is known, and the ways in which tests damage them."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np

from compass_ros.episodes import Source, default_sources
from compass_ros.episodes.definitions import POSE_TYPE, embedded_definition, typestore
from compass_ros.episodes.writer import BagWriter
from compass_ros.types import Episode, Track

START_NS = 1_700_000_000_123_456_789
PUCKS = default_sources(["puck1", "puck2"])
ALL = (
    *PUCKS,
    *default_sources(["ball"], "xyz"),
    *default_sources(["cube"], "pose"),
    *default_sources(["hinge"], "joint"),
)


def episode(name: str = "shot", seed: int = 0, frames: int = 60) -> Episode:
    """An episode with a track of every quantity, with and without standard deviations."""
    rng = np.random.default_rng(seed)
    stamps = START_NS + 5_000_000 + np.cumsum(rng.integers(15_000_000, 18_000_000, frames))
    return Episode(
        name=name,
        cell="air_hockey",
        cell_hash="a1b2",
        action={"x": -0.2231, "y": 0.07, "velocity": 1 / 3},
        start_ns=START_NS,
        tracks=(
            Track("puck1", "xy", stamps, rng.normal(size=(frames, 2)), rng.uniform(1e-4, 1e-2, frames)),
            Track("puck2", "xy", stamps[::2] + 1, rng.normal(size=(len(stamps[::2]), 2))),
            Track("ball", "xyz", stamps, rng.normal(size=(frames, 3)), np.full(frames, 1e-3)),
            Track("cube", "pose", stamps, rng.normal(size=(frames, 7))),
            Track("hinge", "joint", stamps, rng.normal(size=(frames, 1)), rng.uniform(1e-4, 1e-2, frames)),
        ),
        initial_state={"puck1": (0.1, -0.2), "hinge": (1e-300, 2.0)},
    )


def assert_same(one: Episode, other: Episode) -> None:
    """Equal bit for bit, but for the source."""
    assert (one.name, one.cell, one.cell_hash, one.start_ns) == (
        other.name,
        other.cell,
        other.cell_hash,
        other.start_ns,
    )
    assert dict(one.action) == dict(other.action)
    assert {k: tuple(v) for k, v in one.initial_state.items()} == {k: tuple(v) for k, v in other.initial_state.items()}
    assert [(t.object, t.quantity) for t in one.tracks] == [(t.object, t.quantity) for t in other.tracks]
    for a, b in zip(one.tracks, other.tracks, strict=True):
        np.testing.assert_array_equal(a.stamp_ns, b.stamp_ns)
        np.testing.assert_array_equal(a.value, b.value)
        assert (a.std is None) == (b.std is None)
        if a.std is not None and b.std is not None:
            np.testing.assert_array_equal(a.std, b.std)


def digest(bag: Path) -> dict[str, str]:
    """Hash of every file of a bag."""
    return {file.name: hashlib.sha256(file.read_bytes()).hexdigest() for file in sorted(bag.iterdir())}


def mcap_file(bag: Path) -> Path:
    (file,) = bag.glob("*.mcap")
    return file


def pose_bytes(stamp_ns: int, x: float = 0.0, y: float = 0.0, variance: float = 0.0) -> bytes:
    """A PoseWithCovarianceStamped in CDR, made by rosbags."""
    store = typestore()
    types = store.types
    point = types["geometry_msgs/msg/Point"](x=x, y=y, z=0.0)
    turn = types["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0)
    pose = types["geometry_msgs/msg/Pose"](position=point, orientation=turn)
    covariance = np.eye(6).ravel() * variance
    stated = types["geometry_msgs/msg/PoseWithCovariance"](pose=pose, covariance=covariance)
    stamp = types["builtin_interfaces/msg/Time"](sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9)
    header = types["std_msgs/msg/Header"](stamp=stamp, frame_id="table")
    return bytes(store.serialize_cdr(types[POSE_TYPE](header=header, pose=stated), POSE_TYPE))


def pose_bag(folder: Path, stamps_ns: list[int], values: list[tuple[float, float]], variance: float = 0.0) -> Path:
    """A bag with poses of puck1 only, as a recorder without anything else around would write it."""
    writer = BagWriter(folder)
    channel = writer.add_topic("/puck_tracker/puck1/pose", embedded_definition(POSE_TYPE))
    for stamp, (x, y) in zip(stamps_ns, values, strict=True):
        writer.write(channel, stamp, stamp, pose_bytes(stamp, x, y, variance))
    writer.close()
    return folder


PUCK1: tuple[Source, ...] = PUCKS[:1]

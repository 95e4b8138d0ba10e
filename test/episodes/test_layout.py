"""Where the numbers of a message are, beside rosbags' own reading of it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest
from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.store import Typestore

from compass_ros.episodes.layout import Fields, Layout, alike, layout, matrix
from compass_ros.errors import BagError
from test.episodes.definitions_of_others import JAZZY, others
from test.episodes.random_messages import leaves, message

TYPES = [
    "sensor_msgs/msg/JointState",
    "trajectory_msgs/msg/JointTrajectory",
    "trajectory_msgs/msg/MultiDOFJointTrajectory",
    "sensor_msgs/msg/Imu",
    "geometry_msgs/msg/WrenchStamped",
    "geometry_msgs/msg/TwistWithCovarianceStamped",
    "tf2_msgs/msg/TFMessage",
    "nav_msgs/msg/Odometry",
    "std_msgs/msg/Float64MultiArray",
    "std_msgs/msg/Empty",
    "std_msgs/msg/Bool",
    "diagnostic_msgs/msg/DiagnosticArray",
    "visualization_msgs/msg/MarkerArray",
    "sensor_msgs/msg/PointCloud2",
    "sensor_msgs/msg/BatteryState",
    *(name for name in JAZZY if not name.endswith(("Nothing", "Drive"))),
]
SEEDS = range(6)


def fields(store: Typestore) -> Fields:
    return {name: own for name, (_, own) in store.fielddefs.items()}


def said(found: Layout, data: bytes) -> Mapping[str, object]:
    numbers = {path: place.of(matrix([data]))[0].tolist() for path, place in found.places.items() if place.count}
    return {**numbers, **found.texts}


def expected(value: object) -> Mapping[str, object]:
    every = {path: one for path, one in leaves(value).items() if one != []}
    return {
        path: [int(n) if isinstance(n, bool) else n for n in one] if isinstance(one, list) else one
        for path, one in every.items()
    }


@pytest.mark.parametrize("name", TYPES)
@pytest.mark.parametrize("little", [True, False], ids=["little", "big"])
def test_every_number_and_text_of_cdr(name: str, little: bool) -> None:
    store = others()
    for seed in SEEDS:
        planted = message(store, name, np.random.default_rng(seed))
        data = bytes(store.serialize_cdr(planted, name, little_endian=little))
        assert said(layout(fields(store), name, data), data) == expected(planted)


ROS1_TYPES = [
    name for name in TYPES if name in get_typestore(Stores.ROS1_NOETIC).fielddefs and name != "std_msgs/msg/Empty"
]


@pytest.mark.parametrize("name", ROS1_TYPES)
def test_every_number_and_text_of_ros1(name: str) -> None:
    store = get_typestore(Stores.ROS1_NOETIC)
    for seed in SEEDS:
        planted = message(store, name, np.random.default_rng(seed))
        data = bytes(store.serialize_ros1(planted, name))
        assert said(layout(fields(store), name, data, ros1=True), data) == expected(planted)


@pytest.mark.parametrize(
    "name",
    [
        "sensor_msgs/msg/JointState",
        "tf2_msgs/msg/TFMessage",
        "vendor_msgs/msg/LowState",
        "trajectory_msgs/msg/JointTrajectory",
        "diagnostic_msgs/msg/DiagnosticArray",
    ],
)
def test_messages_laid_out_alike_have_their_numbers_at_the_same_places(name: str) -> None:
    """Of many messages those that `alike` puts together are read by the layout of one of them."""
    store, rng = others(), np.random.default_rng(3)
    planted = [message(store, name, rng) for _ in range(300)]
    data = [bytes(store.serialize_cdr(one, name)) for one in planted]
    checked = 0
    for size in {len(one) for one in data}:
        own = [i for i, one in enumerate(data) if len(one) == size]
        found = layout(fields(store), name, data[own[0]])
        for i, same in zip(own, alike(matrix([data[i] for i in own]), 0, found.fixed), strict=True):
            structure = [(path, one if isinstance(one, str) else len(one)) for path, one in leaves(planted[i]).items()]
            first = [(path, one if isinstance(one, str) else len(one)) for path, one in leaves(planted[own[0]]).items()]
            assert same == (structure == first)
            if same:
                assert said(found, data[i]) == expected(planted[i])
                checked += 1
    assert checked > 20


def test_a_message_that_is_cut_anywhere_is_refused() -> None:
    store, name = others(), "trajectory_msgs/msg/JointTrajectory"
    data = bytes(store.serialize_cdr(message(store, name, np.random.default_rng(1)), name))
    for size in range(len(data) - 1):
        with pytest.raises(BagError, match="a message is not"):
            layout(fields(store), name, data[:size])
    with pytest.raises(BagError, match=r"1000 of its .* bytes are left over"):
        layout(fields(store), name, data + bytes(1000))


TRAPS: Mapping[str, tuple[str, bytes]] = {
    "holds itself": ("Loop loop", bytes(200)),
    "an array that lies": ("float64[] x", b"\xff\xff\xff\x7f" + bytes(96)),
    "texts that lie": ("string[] x", b"\xff\xff\xff\x7f" + bytes(96)),
    "arrays of nothing": ("Deep[1000] x", bytes(5000)),
    "a fixed array that is longer": ("float64[1000000000] x", bytes(96)),
    "unknown": ("other_msgs/What x", bytes(96)),
}


@pytest.mark.parametrize("trap", TRAPS)
def test_definitions_that_never_end(trap: str) -> None:
    from rosbags.typesys import get_types_from_msg

    text, data = TRAPS[trap]
    types = {
        **get_types_from_msg(text, "x_msgs/msg/Trap"),
        **get_types_from_msg("Loop loop", "x_msgs/msg/Loop"),
        **get_types_from_msg("Nothing[1000] x", "x_msgs/msg/Deep"),
        **get_types_from_msg("", "x_msgs/msg/Nothing"),
    }
    own = {name: defined for name, (_, defined) in types.items()}
    for ros1 in (False, True):
        with pytest.raises(BagError, match=r"a message is not|no definition of other_msgs/msg/What"):
            layout(own, "x_msgs/msg/Trap", data if ros1 else b"\x00\x01\x00\x00" + data, ros1)


@pytest.mark.parametrize("start", [b"", b"\x00", b"\x00\x07\x00\x00", b"\x00\x03\x00\x00\x00", b"{}  "])
def test_what_is_not_plain_cdr(start: bytes) -> None:
    with pytest.raises(BagError, match="not in plain CDR"):
        layout(fields(others()), "std_msgs/msg/Bool", start)

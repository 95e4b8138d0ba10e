"""Inputs and signals as messages of every kind say them: planted numbers come back to the last bit."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.typesys.store import Typestore

from compass_ros.episodes import Source, read_episode
from compass_ros.episodes.sources import Part
from compass_ros.errors import BagError
from compass_ros.types import Floats, Quantity, Track
from test.episodes.definitions_of_others import STATE, others
from test.episodes.robots import (
    FRAMES,
    JOINTS,
    MS,
    PLANTED,
    POSITION,
    STAMPS,
    START,
    Logged,
    array,
    header,
    joint_state,
    point,
    vector,
    write,
)

STORAGES = ("mcap", "sqlite3", "mcap_ros2")
_, VELOCITY, EFFORT = PLANTED
NAN = float("nan")


def source(quantity: Quantity, of: Sequence[str] = JOINTS, part: Part = "feedback", **more: Any) -> Source:
    return Source("/robot", "arm", quantity, of=tuple(of), part=part, **more)


def state(store: Typestore, i: int) -> Any:
    """Joints in another order in every message, and one that nobody asks for."""
    order = np.roll(np.arange(3), i)
    names = [*(JOINTS[k] for k in order), "finger"]
    position, velocity, effort = ([*numbers[i][order], 9.0] for numbers in PLANTED)
    return joint_state(store, STAMPS[i], names, position, velocity, effort)


def controller(store: Typestore, i: int, **parts: int) -> Any:
    """Each of these parts holds a row of PLANTED as positions, its negative as velocities."""
    kind = store.types[STATE]
    fields = [name for name, _ in store.fielddefs[STATE][1]]
    filled: dict[str, Any] = {"header": header(store, STAMPS[i]), "joint_names": list(JOINTS)}
    filled |= {"multi_dof_joint_names": [], "speed_scaling_factor": 1.0}
    multi = store.types["trajectory_msgs/msg/MultiDOFJointTrajectoryPoint"]
    for name in fields:
        if name.startswith("multi_dof_") and name not in filled:
            filled[name] = multi([], [], [], point(store).time_from_start)
        elif name not in filled:
            rows = PLANTED[parts[name], i] if name in parts else ()
            filled[name] = point(store, positions=rows, velocities=-np.array(rows))
    return kind(**{name: filled[name] for name in fields})


def dynamic(store: Typestore, i: int) -> Any:
    """Interfaces in another order for each joint; one joint has no effort."""
    value = store.types["control_msgs/msg/InterfaceValue"]
    numbers = dict(zip(("position", "velocity", "effort"), PLANTED[:, i], strict=True))
    own = [np.roll(["position", "velocity", "effort"], k)[: 3 - (k == 2)].tolist() for k in range(3)]
    values = [value(names, np.array([numbers[name][k] for name in names])) for k, names in enumerate(own)]
    return store.types["control_msgs/msg/DynamicJointState"](header(store, STAMPS[i]), list(JOINTS), values)


def dof(store: Typestore, i: int, k: int) -> Any:
    made = store.types["control_msgs/msg/SingleDOFState"]
    return made(JOINTS[k], POSITION[i, k], VELOCITY[i, k], 1.0, 2.0, 3.0, 0.001, EFFORT[i, k])


def low_state(store: Typestore, i: int) -> Any:
    motor = store.types["vendor_msgs/msg/Motor"]
    motors = [motor(1, POSITION[i, k], VELOCITY[i, k], EFFORT[i, k], 40) for k in range(3)]
    quaternion, head = np.array([1, 0, 0, 0], np.float32), np.array([1, 2], np.uint8)
    return store.types["vendor_msgs/msg/LowState"](head, motors, quaternion, EFFORT[i].copy(), True)


def drive(store: Typestore, i: int) -> Any:
    nothing = store.types["vendor_msgs/msg/Nothing"]()
    return store.types["vendor_msgs/msg/Drive"](header(store, STAMPS[i]), nothing, i, "left", POSITION[i, 0])


SINGLE = np.float32
Case = tuple[Callable[[Typestore, int], Any], Source, Floats, bool]
"""Message of a frame, what is read of it, what is expected, whether the message has a stamp."""
CASES: dict[str, Case] = {
    "positions": (state, source("joint_position"), POSITION, True),
    "velocities": (state, source("joint_velocity"), VELOCITY, True),
    "efforts of two": (state, source("joint_effort", JOINTS[::-2]), EFFORT[:, ::-2], True),
    "reference": (
        lambda s, i: controller(s, i, reference=0, feedback=1, output=2),
        source("joint_position", part="reference"),
        POSITION,
        True,
    ),
    "feedback": (
        lambda s, i: controller(s, i, reference=0, feedback=1, output=2),
        source("joint_position"),
        VELOCITY,
        True,
    ),
    "feedback's velocity": (
        lambda s, i: controller(s, i, reference=0, feedback=1, output=2),
        source("joint_velocity"),
        -VELOCITY,
        True,
    ),
    "output": (
        lambda s, i: controller(s, i, reference=0, feedback=1, output=2),
        source("joint_position", part="output"),
        EFFORT,
        True,
    ),
    "dynamic": (dynamic, source("joint_velocity"), VELOCITY, True),
    "single degree": (
        lambda s, i: s.types["control_msgs/msg/SingleDOFStateStamped"](header(s, STAMPS[i]), dof(s, i, 1)),
        source("joint_position", ["elbow"]),
        VELOCITY[:, 1:2],
        True,
    ),
    "its output": (
        lambda s, i: s.types["control_msgs/msg/SingleDOFStateStamped"](header(s, STAMPS[i]), dof(s, i, 1)),
        source("joint_effort", ["elbow"], "output"),
        EFFORT[:, 1:2],
        True,
    ),
    "several degrees": (
        lambda s, i: s.types["control_msgs/msg/MultiDOFStateStamped"](
            header(s, STAMPS[i]), [dof(s, i, k) for k in (2, 0, 1)]
        ),
        source("joint_position", part="reference"),
        POSITION,
        True,
    ),
    "commands of degrees": (
        lambda s, i: s.types["control_msgs/msg/MultiDOFCommand"](
            ["wrist", "lift"], POSITION[i, [2, 0]].copy(), np.zeros(0)
        ),
        source("joint_position", ["lift", "wrist"], drives=True),
        POSITION[:, [0, 2]],
        False,
    ),
    "numbers in order": (lambda s, i: array(s, EFFORT[i]), source("scalar", ["a", "b", "c"]), EFFORT, False),
    "numbers of joints": (lambda s, i: array(s, POSITION[i]), source("joint_position", drives=True), POSITION, False),
    "single precision": (
        lambda s, i: array(s, POSITION[i], "Float32MultiArray"),
        source("scalar", "abc"),
        POSITION.astype(SINGLE).astype(float),
        False,
    ),
    "one number": (
        lambda s, i: s.types["std_msgs/msg/Float64"](POSITION[i, 0]),
        source("scalar", ["u"]),
        POSITION[:, :1],
        False,
    ),
    "a whole number": (
        lambda s, i: s.types["std_msgs/msg/Int16"](3 * i),
        source("scalar", ["u"]),
        3.0 * np.arange(FRAMES)[:, None],
        False,
    ),
    "twist": (
        lambda s, i: s.types["geometry_msgs/msg/Twist"](vector(s, POSITION[i]), vector(s, VELOCITY[i])),
        source("twist", ()),
        np.hstack([POSITION, VELOCITY]),
        False,
    ),
    "two numbers of a twist": (
        lambda s, i: s.types["geometry_msgs/msg/TwistStamped"](
            header(s, STAMPS[i]), s.types["geometry_msgs/msg/Twist"](vector(s, POSITION[i]), vector(s, VELOCITY[i]))
        ),
        source("twist", ("wz", "vx"), drives=True),
        np.column_stack([VELOCITY[:, 2], POSITION[:, 0]]),
        True,
    ),
    "wrench": (
        lambda s, i: s.types["geometry_msgs/msg/Wrench"](vector(s, POSITION[i]), vector(s, EFFORT[i])),
        source("wrench", ()),
        np.hstack([POSITION, EFFORT]),
        False,
    ),
    "wrench with a stamp": (
        lambda s, i: s.types["geometry_msgs/msg/WrenchStamped"](
            header(s, STAMPS[i]), s.types["geometry_msgs/msg/Wrench"](vector(s, POSITION[i]), vector(s, EFFORT[i]))
        ),
        source("wrench", ()),
        np.hstack([POSITION, EFFORT]),
        True,
    ),
    "paths of a vendor's": (
        low_state,
        source("joint_position", [f"motors[{k}].q" for k in (2, 0)]),
        POSITION[:, [2, 0]].astype(SINGLE).astype(float),
        False,
    ),
    "an array's number": (
        low_state,
        source("scalar", ["foot_force[1]", "motors[1].tau_est"]),
        np.column_stack([EFFORT[:, 1], EFFORT[:, 1].astype(SINGLE)]),
        False,
    ),
    "a vendor's with a header": (
        drive,
        source("scalar", ["current", "status"]),
        np.column_stack([POSITION[:, 0], np.arange(FRAMES)]),
        True,
    ),
    "scalars of a JointState": (
        lambda s, i: joint_state(s, STAMPS[i], JOINTS, POSITION[i], (), EFFORT[i]),
        source("scalar", ["effort[2]", "position"]),
        np.column_stack([EFFORT[:, 2], POSITION[:, 0]]),
        True,
    ),
}


def log(make: Callable[[Typestore, int], Any], store: Typestore) -> list[Logged]:
    """Logged 2 ms after they were stamped."""
    return [("/robot", int(STAMPS[i]) + 2 * MS, make(store, i)) for i in range(FRAMES)]


def read(path: Path, one: Source) -> Track:
    found = read_episode(path, [one])
    return (found.inputs if one.drives else found.tracks)[0]


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("storage", STORAGES)
def test_planted_numbers(tmp_path: Path, case: str, storage: str) -> None:
    make, one, expected, stamped = CASES[case]
    store = others()
    track = read(write(tmp_path / "bag", log(make, store), store, storage), one)
    assert (track.object, track.quantity) == ("arm", one.quantity)
    np.testing.assert_array_equal(track.value, expected)
    assert track.stamp_ns.tolist() == [int(stamp) + (0 if stamped else 2 * MS) for stamp in STAMPS]


HUMBLE = {
    "as it is": ({"reference": 0, "feedback": 1}, "feedback", VELOCITY),
    "its reference": ({"reference": 0, "feedback": 1}, "reference", POSITION),
    "until then": ({"desired": 0, "actual": 1}, "feedback", VELOCITY),
    "its desired": ({"desired": 0, "actual": 1}, "reference", POSITION),
    "both": ({"desired": 2, "actual": 2, "reference": 0, "feedback": 1}, "reference", POSITION),
}


@pytest.mark.parametrize("case", HUMBLE)
def test_controllers_of_humble(tmp_path: Path, case: str) -> None:
    """Another definition under the same name: read by what the bag says."""
    parts, part, expected = HUMBLE[case]
    store = others("humble")
    bag = write(tmp_path / "bag", log(lambda s, i: controller(s, i, **parts), store), store)
    np.testing.assert_array_equal(read(bag, source("joint_position", part=part)).value, expected)  # type: ignore[arg-type]


def imu(store: Typestore, i: int, gyro: bool, accelerometer: bool, frame: str = "imu") -> Any:
    no, yes = np.array([-1.0] + [0.0] * 8), np.zeros(9)
    turn = store.types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0)
    return store.types["sensor_msgs/msg/Imu"](
        header(store, STAMPS[i], frame),
        turn,
        no,
        vector(store, POSITION[i]),
        yes if gyro else no,
        vector(store, EFFORT[i]),
        yes if accelerometer else no,
    )


def test_an_imu_says_what_it_measures(tmp_path: Path) -> None:
    """Where a covariance begins with -1 nothing was measured, whatever the numbers are."""
    store = others()
    said = [("/robot", int(STAMPS[i]), imu(store, i, i % 3 > 0, i % 2 > 0)) for i in range(FRAMES)]
    found = read_episode(write(tmp_path / "bag", said), [source("gyro", ()), source("accelerometer", ())])
    keep = [np.flatnonzero(np.arange(FRAMES) % k) for k in (3, 2)]
    for track, planted, own in zip(found.tracks, (POSITION, EFFORT), keep, strict=True):
        np.testing.assert_array_equal(track.value, planted[own])
        assert track.stamp_ns.tolist() == STAMPS[own].tolist()


def test_two_sensors_on_one_topic(tmp_path: Path) -> None:
    store = others()
    said = [("/robot", int(STAMPS[i]), imu(store, i, True, True, f"imu{i % 2}")) for i in range(FRAMES)]
    bag = write(tmp_path / "bag", said)
    for k in (0, 1):
        np.testing.assert_array_equal(read(bag, source("gyro", (), entry=f"imu{k}")).value, POSITION[k::2])
    with pytest.raises(BagError, match=r"no messages of 'imu2' on /robot .*there are imu0, imu1"):
        read(bag, source("gyro", (), entry="imu2"))


def rows(track: Track) -> list[list[float | None]]:
    return [[None if np.isnan(number) else float(number) for number in row] for row in track.value]


PARTIAL: dict[str, tuple[list[tuple[int, Sequence[str], Sequence[float]]], list[list[float | None]]]] = {
    "one joint each": (
        [(0, ["lift"], [1]), (5, ["elbow"], [2]), (10, ["wrist"], [3]), (15, ["lift"], [4])],
        [[1, None, None], [None, 2, None], [None, None, 3], [4, None, None]],
    ),
    "one late": (
        [(0, JOINTS, [1, 2, 3]), (5, ["wrist"], [4]), (10, JOINTS, [5, 6, 7])],
        [[1, 2, 3], [None, None, 4], [5, 6, 7]],
    ),
    "two at one stamp": (
        [(0, ["lift", "wrist"], [1, 3]), (0, ["elbow"], [2]), (5, ["elbow"], [5]), (5, ["wrist"], [6])],
        [[1, 2, 3], [None, 5, 6]],
    ),
    "two publishers, one late": (
        [(3, ["lift"], [1]), (0, ["elbow", "wrist"], [2, 3]), (8, ["lift"], [4]), (5, ["elbow", "wrist"], [5, 6])],
        [[None, 2, 3], [1, None, None], [None, 5, 6], [4, None, None]],
    ),
    "nan and infinity": (
        [(0, JOINTS, [1, NAN, 3]), (5, JOINTS, [NAN, NAN, float("inf")]), (10, JOINTS, [4, 5, 6])],
        [[1, None, 3], [4, 5, 6]],
    ),
    "come twice": (
        [(0, JOINTS, [1, NAN, 3]), (0, JOINTS, [1, NAN, 3]), (5, JOINTS, [4, 5, 6])],
        [[1, None, 3], [4, 5, 6]],
    ),
    "empty between": (
        [(0, JOINTS, [1, 2, 3]), (5, JOINTS, []), (6, [], []), (10, JOINTS, [4, 5, 6])],
        [[1, 2, 3], [4, 5, 6]],
    ),
}


@pytest.mark.parametrize("case", PARTIAL)
def test_partial_messages(tmp_path: Path, case: str) -> None:
    said, expected = PARTIAL[case]
    store = others()
    logged: list[Logged] = [
        ("/robot", START + i * MS, joint_state(store, START + at * MS, names, numbers))
        for i, (at, names, numbers) in enumerate(said)
    ]
    track = read(write(tmp_path / "bag", logged), source("joint_position"))
    assert rows(track) == expected
    assert (np.diff(track.stamp_ns) > 0).all()


def test_one_joint_out_of_order(tmp_path: Path) -> None:
    store = others()
    said = [(0, ["lift"], [1.0]), (5, ["elbow"], [2.0]), (3, ["lift"], [3.0]), (4, ["elbow"], [2.0])]
    logged: list[Logged] = [
        ("/robot", START + i * MS, joint_state(store, START + at * MS, n, x)) for i, (at, n, x) in enumerate(said)
    ]
    with pytest.raises(BagError, match=r"out of order: message 2 of elbow is stamped .*, 1000000 ns before"):
        read(write(tmp_path / "bag", logged), source("joint_position", ("lift", "elbow")))


ABSENT: dict[str, tuple[Source, str]] = {
    "a joint": (source("joint_position", ("lift", "knee")), "no messages of 'knee' on /robot .*; there are elbow"),
    "a quantity": (source("joint_effort"), "/robot names 'lift', but holds no 'joint_effort' of it"),
    "its kind": (source("wrench", ()), "a sensor_msgs/msg/JointState holds no 'wrench' of arm"),
    "a path": (source("scalar", ("efort",)), "`of` names numbers, as .*; found 'efort'"),
    "an index": (source("scalar", ("position[3]",)), r"found 'position\[3\]'"),
    "a topic": (Source("/robots", "arm", "joint_position", of=JOINTS), "no topic /robots for arm.*mean '/robot'"),
}


@pytest.mark.parametrize("case", ABSENT)
def test_what_is_not_there_is_said(tmp_path: Path, case: str) -> None:
    one, said = ABSENT[case]
    store = others()
    bag = write(tmp_path / "bag", [("/robot", START, joint_state(store, START, JOINTS, [1, 2, 3], [4, 5, 6]))])
    with pytest.raises(BagError, match=said):
        read(bag, one)


def test_a_list_of_another_length(tmp_path: Path) -> None:
    bag = write(tmp_path / "bag", [("/robot", START, array(others(), np.zeros(2)))])
    with pytest.raises(BagError, match=r"/robot: a message has 2 numbers; expected 3 \(lift, elbow, wrist\)"):
        read(bag, source("joint_position"))

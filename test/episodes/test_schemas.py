"""Definitions: as the bag carries them, as they are standard, as they are installed; and where there is none."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import Writer as McapWriter
from rosbags.rosbag1 import Writer as Writer1
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from compass_ros.episodes import Source, list_topics, read_episode
from compass_ros.errors import BagError
from test.episodes.definitions_of_others import others
from test.episodes.robots import FRAMES, MS, POSITION, STAMPS, START, Logged, joint_state, write
from test.episodes.test_series import drive

CURRENT = Source("/drive", "current", "scalar", of=("current",))
KIND = "vendor_msgs/msg/Drive"
TEXT = others().generate_msgdef(KIND, ros_version=2)[0]


def logged() -> list[Logged]:
    return [("/drive", int(STAMPS[i]), drive(others(), i)) for i in range(FRAMES)]


def mcap(path: Path, text: str, encoding: str = "ros2msg", name: str = KIND) -> Path:
    """The same by mcap's writer, with any text as the definition."""
    with path.open("wb") as file:
        writer = McapWriter(file)
        writer.start("ros2")
        channel = writer.register_channel("/drive", "cdr", writer.register_schema(name, encoding, text.encode()))
        for _, at, message in logged():
            writer.add_message(channel, at, bytes(others().serialize_cdr(message, KIND)), at)
        writer.finish()  # type: ignore[no-untyped-call]
    return path


IDL = f"""{"=" * 80}
IDL: vendor_msgs/msg/Drive
#include "std_msgs/msg/Header.idl"
module vendor_msgs {{ module msg {{
struct Drive {{
  std_msgs::msg::Header header; vendor_msgs::msg::Nothing reserved;
  @default (value=3) int16 status; string<20> label; double current; }};
}}; }};
{"=" * 80}
IDL: vendor_msgs/msg/Nothing
module vendor_msgs {{ module msg {{ struct Nothing {{ uint8 structure_needs_at_least_one_member; }}; }}; }};
"""
TEXTS = {
    "as rosbag2 writes it": (TEXT, "ros2msg"),
    "of Windows": (TEXT.replace("\n", "\r\n"), "ros2msg"),
    "without the standard ones": (TEXT.split("=" * 80)[0] + "=" * 80 + "\nMSG: vendor_msgs/Nothing\n", "ros2msg"),
    "with comments": ("# a drive\n\n" + TEXT.replace("int16 status", "int16   status   # of the drive"), "ros2msg"),
    "as IDL": (IDL, "ros2idl"),
}


@pytest.mark.parametrize("case", TEXTS)
def test_a_vendors_definition(tmp_path: Path, case: str) -> None:
    track = read_episode(mcap(tmp_path / "a.mcap", *TEXTS[case]), [CURRENT]).tracks[0]
    np.testing.assert_array_equal(track.value, POSITION[:, :1])
    np.testing.assert_array_equal(track.stamp_ns, STAMPS)


BROKEN = {
    "none": ("", "carries no definition of vendor_msgs/msg/Drive, and no definition of it|is installed"),
    "no text of a message": ("float64 (", "the definition of vendor_msgs/msg/Drive in the bag cannot be read"),
    "of another": ("float64 x\n", "a message is not a vendor_msgs/msg/Drive: .* bytes are left over"),
    "without a part": ("what_msgs/Where x\n", "the bag holds no definition of what_msgs/msg/Where"),
    "endless": ("float64 x\n" * 200_000, r"has 2000000 characters; at most"),
    "of letters that are not read": ("wstring x\n", "no definition of vendor_msgs/msg/wstring"),
}


@pytest.mark.parametrize("case", BROKEN)
def test_definitions_that_do_not_help(tmp_path: Path, case: str) -> None:
    text, said = BROKEN[case]
    with pytest.raises(BagError, match=said) as caught:
        read_episode(mcap(tmp_path / "a.mcap", text), [CURRENT])
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 600


def test_a_known_type_whose_text_is_damaged_is_read_as_it_is_known(tmp_path: Path) -> None:
    kind, store = "sensor_msgs/msg/JointState", others()
    with (tmp_path / "a.mcap").open("wb") as file:
        writer = McapWriter(file)
        writer.start("ros2")
        channel = writer.register_channel("/joint_states", "cdr", writer.register_schema(kind, "ros2msg", b"float64 ("))
        writer.add_message(channel, START, bytes(store.serialize_cdr(joint_state(store, START, "a", [7]), kind)), START)
        writer.finish()  # type: ignore[no-untyped-call]
    found = read_episode(tmp_path / "a.mcap", [Source("/joint_states", "a", "joint")])
    assert found.tracks[0].value.tolist() == [[7]]


def without_table(path: Path) -> Path:
    """As rosbag2 wrote before version 4 of its format."""
    with sqlite3.connect(next(path.glob("*.db3"))) as database:
        database.execute("DROP TABLE message_definitions")
    text = (path / "metadata.yaml").read_text().splitlines(keepends=True)
    (path / "metadata.yaml").write_text("".join(line for line in text if "type_description_hash" not in line))
    return path


def test_databases_carry_definitions_and_older_ones_do_not(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    bag = write(tmp_path / "bag", logged(), storage="sqlite3")
    np.testing.assert_array_equal(read_episode(bag, [CURRENT]).tracks[0].value, POSITION[:, :1])
    old = without_table(bag)
    with pytest.raises(BagError, match=r"/bag: /drive: the bag carries no definition of vendor_msgs/msg/Drive"):
        read_episode(old, [CURRENT])
    share = tmp_path / "share" / "vendor_msgs" / "msg"
    share.mkdir(parents=True)
    (share / "Drive.msg").write_text(
        "std_msgs/Header header\nNothing reserved\nint16 status 3\nstring<=20 label\nfloat64 current\n"
    )
    (share / "Nothing.msg").write_text("")
    for part in ("std_msgs/msg/Header", "builtin_interfaces/msg/Time"):
        (tmp_path / "share" / part).parent.mkdir(parents=True, exist_ok=True)
        text = others().generate_msgdef(part, ros_version=2)[0].split("=" * 80)[0]
        (tmp_path / "share" / f"{part}.msg").write_text(text)
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path))
    (share / "Drive.json").write_text('{"type_hashes": [{"type_name": "vendor_msgs/msg/Drive", "hash_string": ""}]}')
    np.testing.assert_array_equal(read_episode(old, [CURRENT]).tracks[0].value, POSITION[:, :1])


def ros1(path: Path, change: Callable[[str], str] = str) -> Path:
    """A vendor's message in a ROS 1 bag, whose connection carries the definition."""
    store = get_typestore(Stores.ROS1_NOETIC)
    store.register(get_types_from_msg("Header header\nfloat64[] torque\nbool ok\n", "vendor_msgs/msg/Torque"))
    types = store.types
    with Writer1(path) as writer:
        connection = writer.add_connection("/drive", "vendor_msgs/msg/Torque", typestore=store)
        for i in range(FRAMES):
            stamp = types["builtin_interfaces/msg/Time"](sec=START // 10**9, nanosec=5 * MS * i)
            head = types["std_msgs/msg/Header"](seq=i, stamp=stamp, frame_id="x" * (i % 3))
            message = types["vendor_msgs/msg/Torque"](head, POSITION[i], True)
            writer.write(connection, START + 5 * MS * i, store.serialize_ros1(message, "vendor_msgs/msg/Torque"))
    return path


def test_a_vendors_message_of_ros1(tmp_path: Path) -> None:
    source = Source("/drive", "t", "joint_effort", of=("torque[2]", "torque[0]"))
    track = read_episode(ros1(tmp_path / "a.bag"), [source]).tracks[0]
    np.testing.assert_array_equal(track.value, POSITION[:, [2, 0]])
    np.testing.assert_array_equal(track.stamp_ns, STAMPS)


def test_what_is_known_of_topics(tmp_path: Path) -> None:
    """A vendor's message can be read by the paths of its numbers, and is nothing that is looked for by itself."""
    (topic,) = list_topics(mcap(tmp_path / "a.mcap", TEXT))
    assert (topic.type, topic.messages, topic.known) == (KIND, FRAMES, False)

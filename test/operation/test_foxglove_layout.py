"""Layouts of every cell: each panel has a place, each series is shown, paths lead to fields of the messages."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
from rosbags.typesys import Stores, get_typestore

from compass_ros.cells import load
from compass_ros.cells.loading import cells_folder
from compass_ros.episodes.survey import Held
from compass_ros.operation.foxglove import BEFORE, Plotted, _paths, layout
from compass_ros.types import Quantity
from test.conftest import Run

ROOT = Path(__file__).parents[2]
TYPES = get_typestore(Stores.ROS2_JAZZY).fielddefs
CELLS = sorted(path.stem for path in cells_folder().glob("*.yaml"))


def panels(tree: Any) -> list[str]:
    return [tree] if isinstance(tree, str) else panels(tree["first"]) + panels(tree["second"])


def values(content: Any) -> list[str]:
    return [path["value"] for panel in content["configById"].values() for path in panel.get("paths", ())]


def leads_to(kind: str, path: str) -> str:
    """Type of the field at the end of a path within a message."""
    for step in path.split("."):
        fields = {name: (node, detail) for name, (node, detail) in TYPES[kind][1]}
        name, many = re.fullmatch(r"(\w+)(\[.*)?", step).groups()  # type: ignore[union-attr]
        node, detail = fields[name]
        assert bool(many) == (node.name in ("ARRAY", "SEQUENCE")), step
        kind = str(detail[0][1] if many else detail)
    return kind


def test_the_layout_of_the_table_is_the_one_that_comes_with_the_suite() -> None:
    """`compass layout --cell air_hockey --out config/foxglove_layout.json` writes it anew."""
    assert json.loads((ROOT / "config" / "foxglove_layout.json").read_text()) == layout(load("air_hockey"))


@pytest.mark.parametrize("name", CELLS)
def test_every_series_of_a_cell_has_a_panel_and_every_panel_its_place(name: str) -> None:
    cell = load(name)
    content = layout(cell)
    assert sorted(panels(content["layout"])) == sorted(content["configById"])
    shown = json.dumps(content)
    spec = cell.spec
    series = {one.name: one.topic for one in spec.inputs} | {one.name: one.topic for one in spec.signals}
    for one, topic in (series | {o.name: o.topic for o in spec.objects}).items():
        assert any(key.endswith(f"!{one}") for key in content["configById"]), one
        assert topic in shown


def test_the_order_of_joints_is_that_of_the_messages() -> None:
    cell = load("so101")
    joints = cell.spec.signals[0].of
    there = Held("/joint_states", "sensor_msgs/msg/JointState", "joint_position", ("gripper", *reversed(joints)), True)
    paths = [v for v in values(layout(cell, [there])) if v.startswith("/joint_states")]
    assert paths == [f"/joint_states.position[{len(joints) - i}]" for i in range(len(joints))]
    assert "/joint_states.position[0]" in values(layout(cell))


def test_a_topic_whose_numbers_have_no_path_is_shown_as_it_comes() -> None:
    cell = load("so101")
    there = Held("/joint_states", "control_msgs/msg/DynamicJointState", "joint_position", cell.spec.signals[0].of, True)
    content = layout(cell, [there])
    assert content["configById"]["RawMessages!joints"] == {"topicPath": "/joint_states", "diffEnabled": False}
    lacking = Held("/joint_states", "sensor_msgs/msg/JointState", "joint_position", ("other",), True)
    assert "RawMessages!joints" in layout(cell, [lacking])["configById"]


@pytest.mark.parametrize("kind", [kind for kind in BEFORE if kind in TYPES])
def test_paths_lead_to_numbers(kind: str) -> None:
    quantity: dict[str, Quantity] = {"Twist": "twist", "Wrench": "wrench", "Point": "position", "TFMess": "pose"}
    asked: Quantity = next((q for word, q in quantity.items() if word in kind), "pose")
    held = Held("/a", kind, asked, ("tool",), True)
    found = _paths(Plotted("tool", "/a", asked, (), "feedback", False), [held])
    assert len(found) in (3, 6, 7)
    for _, path in found:
        inside = path.removeprefix("/a.").replace('{child_frame_id=="tool"}', "")
        assert "float64" in leads_to(kind, inside)


def test_the_command_reads_a_bag_and_says_what_is_wrong(tmp_path: Path, run: Run) -> None:
    own = ROOT / "examples" / "own_cell"
    out = tmp_path / "layout.json"
    status, said, err = run("layout", own / "bags" / "swing_1", "--cell", own / "pendulum.yaml", "--out", out)
    assert (status, err) == (0, "")
    assert "Import from file" in said
    assert "/joint_states.position[0]" in values(json.loads(out.read_text()))
    for words in (
        ("--cell", "nothing"),
        (tmp_path / "nowhere", "--cell", "so101"),
        ("--cell", "so101", "--out", "/proc/x/y"),
    ):
        status, said, err = run("layout", *words)
        assert (status, said, err.count("\n")) == (1, "", 1)

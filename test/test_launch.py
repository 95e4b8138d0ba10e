"""The launch files, without ROS's launch: a stand-in for it notes what they would start."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest
import yaml

ROOT = Path(__file__).parents[1]
STAND_IN = {
    "launch": ("LaunchDescription",),
    "launch.actions": ("DeclareLaunchArgument", "SetEnvironmentVariable", "Shutdown"),
    "launch.substitutions": ("LaunchConfiguration", "PathJoinSubstitution"),
    "launch_ros": (),
    "launch_ros.actions": ("Node",),
    "launch_ros.substitutions": ("FindPackageShare",),
}


class Noted(SimpleNamespace):
    """A call: the name of what was called, its arguments, its keywords."""

    kind: str
    args: tuple[Any, ...]
    words: dict[str, Any]


def description(name: str, monkeypatch: pytest.MonkeyPatch) -> list[Noted]:
    """The entities of a launch file."""
    for module, names in STAND_IN.items():
        stand_in = ModuleType(module)
        for one in names:
            setattr(
                stand_in,
                one,
                lambda *args, kind=one, **words: Noted(kind=kind, args=args, words=words),
            )
        monkeypatch.setitem(sys.modules, module, stand_in)
    spec = importlib.util.spec_from_file_location("launch_file", ROOT / "launch" / f"{name}.launch.py")
    assert spec is not None
    assert spec.loader is not None
    loaded = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(loaded)
    entities: list[Noted] = loaded.generate_launch_description().args[0]
    return entities


def used(value: Any) -> set[str]:
    """Names of the launch arguments that are used anywhere inside a value."""
    if isinstance(value, Noted):
        own = {value.args[0]} if value.kind == "LaunchConfiguration" else set()
        return own | used(value.args) | used(value.words)
    if isinstance(value, dict):
        return used(list(value.values()))
    return set().union(*map(used, value)) if isinstance(value, (list, tuple)) else set()


@pytest.mark.parametrize(
    ("name", "nodes"),
    [
        ("virtual_cell", {"virtual_cell", "puck_tracker", "recorder", "calibrator"}),
        ("cell", {"puck_tracker", "recorder", "calibrator", "static_transform_publisher"}),
    ],
)
def test_every_node_exists_and_has_its_file_of_parameters(
    name: str, nodes: set[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    entities = description(name, monkeypatch)
    started = [entity.words for entity in entities if entity.kind == "Node"]
    assert {node["executable"] for node in started} == nodes
    for node in (node for node in started if node["package"] == "compass_ros"):
        assert (ROOT / "compass_ros" / "nodes" / f"{node['executable']}.py").is_file()
        assert (ROOT / "resource" / "bin" / node["executable"]).exists()
        content = yaml.safe_load((ROOT / "config" / f"{node['executable']}.yaml").read_text())
        assert list(content) == ["/**"]
        assert {"namespace", "use_sim_time", f"{node['executable']}_parameters"} <= used(node)


@pytest.mark.parametrize("name", ["virtual_cell", "cell"])
def test_the_end_of_any_node_ends_all(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    nodes = [entity.words for entity in description(name, monkeypatch) if entity.kind == "Node"]
    assert [node["on_exit"].kind for node in nodes] == ["Shutdown"] * len(nodes)
    assert len({node["on_exit"].words["reason"] for node in nodes}) == len(nodes), "each says which it was"


@pytest.mark.parametrize("name", ["virtual_cell", "cell"])
def test_the_tables_frame_is_one_argument(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    nodes = {e.words["executable"]: e.words for e in description(name, monkeypatch) if e.kind == "Node"}
    assert {"puck_tracker", "calibrator"} <= {executable for executable, node in nodes.items() if "frame" in used(node)}
    publisher = nodes.get("static_transform_publisher")
    assert publisher is None or "frame" in used(publisher)
    said = {words for node in nodes.values() for words in node.get("arguments", ()) if isinstance(words, str)}
    assert "table" not in said


@pytest.mark.parametrize("name", ["virtual_cell", "cell"])
def test_every_argument_is_declared_described_and_used(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    entities = description(name, monkeypatch)
    declared = [entity for entity in entities if entity.kind == "DeclareLaunchArgument"]
    assert all(one.words["description"] and "default_value" in one.words for one in declared)
    assert {one.args[0] for one in declared} == used([one for one in entities if one not in declared])
    (profile,) = (one for one in entities if one.kind == "SetEnvironmentVariable")
    assert profile.args[0] == "FASTRTPS_DEFAULT_PROFILES_FILE"
    assert entities.index(profile) < min(i for i, one in enumerate(entities) if one.kind == "Node")


def test_a_real_camera_is_listened_to_where_its_driver_speaks(monkeypatch: pytest.MonkeyPatch) -> None:
    entities = description("cell", monkeypatch)
    tracker = next(e.words for e in entities if e.kind == "Node" and e.words["executable"] == "puck_tracker")
    assert [topic for topic, _ in tracker["remappings"]] == ["image", "camera_info"]
    defaults = {e.args[0]: e.words["default_value"] for e in entities if e.kind == "DeclareLaunchArgument"}
    assert defaults["image"] == "/camera/camera/color/image_raw"

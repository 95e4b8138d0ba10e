"""Imports go one way, and each library has its place; read from the syntax trees, so nothing needs to be installed."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "compass_ros"
MODULES = sorted(PACKAGE.rglob("*.py"))

STEPS = ("cells", "tracking", "episodes", "checks", "simulation", "calibration", "discovery", "policy", "reporting")
JOINS = {
    "posing": 3,
    "estimation": 3,
    "results": 3,
    "operation": 3,
    "selection": 3,
    "planning": 4,
    "targets": 4,
    "concealed": 3,
    "worlds": 2,
    "assembly": 4,
    "pipeline": 5,
    "evaluation": 6,
    "starter": 6,
    "bench": 6,
    "rivals": 6,
    "proof": 6,
    "real": 6,
    "demo": 6,
    "transfer": 6,
    "commands": 7,
    "cli": 8,
    "nodes": 8,
    "program": 9,
}
LAYERS = {
    "types": 0,
    "errors": 0,
    "extras": 0,
    "plain_yaml": 0,
    "places": 0,
    "config": 1,
    "progress": 1,
    "executors": 1,
    **dict.fromkeys(STEPS, 2),
    **JOINS,
}
"""A module imports from lower layers, or from its own part."""

HOMES = {
    ("mujoco", "robosuite"): {"simulation", "cells", "concealed", "targets"},
    ("torch",): {"calibration", "policy"},
    ("numba",): {"worlds"},
    ("ray",): {"executors"},
    ("jax",): {"targets"},
    ("pysindy", "sklearn"): {"rivals"},
    ("cv2",): {"tracking"},
    ("rosbags", "mcap", "mcap_ros2"): {"episodes"},
    ("rclpy", "launch", "launch_ros", "ament_index_python", "rcl_interfaces", "action_msgs"): {"nodes"},
    ("builtin_interfaces", "std_msgs", "std_srvs", "sensor_msgs", "geometry_msgs", "tf2_msgs"): {"nodes"},
    ("visualization_msgs", "nav_msgs", "lifecycle_msgs", "diagnostic_msgs", "compass_ros_interfaces"): {"nodes"},
    ("domain_coordinator",): {"nodes", "demo"},
}
"""Which parts of the package may import these libraries."""
HOME = {library: parts for libraries, parts in HOMES.items() for library in libraries}

GUESTS = {
    "calibration/rivals/mujoco_sysid.py": {"mujoco"},
    "rivals/inertias.py": {"mujoco"},
    "rivals/inverse_dynamics.py": {"mujoco"},
}
"""Single modules that may import a library away from its home: rivals that are MuJoCo's own system identification, and
regression on its inverse dynamics."""

PROGRAMS = {"concealed/blind.py"}
"""Modules that are processes of their own: they may call the command line, and nobody imports them."""

NEIGHBOURS = {
    ("simulation", "cells"),
    ("checks", "cells"),
    ("checks", "simulation"),
    ("checks", "calibration"),
    ("discovery", "cells"),
    ("discovery", "simulation"),
    ("discovery", "calibration"),
    ("policy", "simulation"),
    ("real", "proof"),
    ("policy", "cells"),
    ("transfer", "bench"),
}
"""Parts of one layer that know each other: what is simulated is a cell, an effect is part of a simulator, and sealed
worlds and recordings of others are judged by the same command."""


def part_of(path: Path) -> str:
    """The first name under compass_ros: a folder or a module; the package itself is '__init__'."""
    if str(path.relative_to(PACKAGE)) in PROGRAMS:
        return "program"
    return path.relative_to(PACKAGE).parts[0].removesuffix(".py")


def imports(tree: ast.AST) -> Iterator[str]:
    """Every module that is imported anywhere in a file, also inside functions, as a dotted name."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def complaints(part: str, tree: ast.AST, guests: frozenset[str] | set[str] = frozenset()) -> list[str]:
    """What is wrong with the imports of one module that belongs to `part`, and to which `guests` are allowed."""
    found = []
    for name in imports(tree):
        first, _, rest = name.partition(".")
        if part not in HOME.get(first, {part}) and first not in guests:
            found.append(f"{name}: only {sorted(HOME[first])} may")
        target = rest.partition(".")[0]
        apart = target != part and (part, target) not in NEIGHBOURS
        if first == "compass_ros" and apart and LAYERS.get(target, -1) >= LAYERS.get(part, 0):
            found.append(f"{name}: upwards or sideways from {part}")
    return found


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def test_module_imports_downwards_and_from_its_own_libraries(path: Path) -> None:
    assert part_of(path) in {*LAYERS, "__init__"}, "a part that the layout does not know"
    guests = GUESTS.get(str(path.relative_to(PACKAGE)), set())
    assert complaints(part_of(path), ast.parse(path.read_text(encoding="utf-8")), guests) == []


@pytest.mark.parametrize(
    ("part", "source"),
    [
        ("tracking", "import rclpy"),
        ("calibration", "def f():\n    import mujoco.rollout"),
        ("nodes", "from torch import nn"),
        ("cells", "from compass_ros.simulation import Simulator"),
        ("simulation", "from compass_ros import pipeline"),
        ("config", "import compass_ros.pipeline"),
        ("types", "from compass_ros.config import CompassConfig"),
        ("pipeline", "from compass_ros.cli import main"),
    ],
)
def test_the_rules_notice_each_kind_of_breach(part: str, source: str) -> None:
    assert len(complaints(part, ast.parse(source))) == 1


def test_nobody_imports_a_program() -> None:
    programs = {f"compass_ros.{name.removesuffix('.py').replace('/', '.')}" for name in PROGRAMS}
    for path in MODULES:
        imported = set(imports(ast.parse(path.read_text(encoding="utf-8"))))
        assert not any(f"{name}.".startswith(f"{program}.") for name in imported for program in programs), path


def test_the_rules_allow_what_is_allowed() -> None:
    source = "import numpy, cv2\nfrom compass_ros.types import Track\nfrom compass_ros.tracking.camera import Camera"
    assert complaints("tracking", ast.parse(source)) == []


@pytest.mark.ros
def test_the_tracker_node_starts_without_torch_and_mujoco() -> None:
    code = "import sys, compass_ros.nodes.puck_tracker; print(*{'torch', 'mujoco', 'robosuite'} & sys.modules.keys())"
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert done.stdout.strip() == ""

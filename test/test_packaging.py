"""What is installed is what is needed: dependencies, versions, and the files that `ros2 run` looks for."""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
import sysconfig
from importlib.metadata import Distribution, packages_distributions
from pathlib import Path

import pytest

from test.test_layering import HOMES, MODULES, ROOT, imports

NODES = ("calibration_client", "calibrator", "puck_tracker", "recorder", "shooter", "virtual_cell")
FROM_ROS = {library for libraries, parts in HOMES.items() for library in libraries if "nodes" in parts}
PREFIX = Path(sys.prefix)


def plain(name: str) -> str:
    """The name of a distribution without version, extras and spelling."""
    return re.split(r"[^A-Za-z0-9._-]", name)[0].lower().replace("_", "-")


def declared() -> set[str]:
    """What the installed package says that it needs; not what an old build may have left in the working directory."""
    (installed,) = Distribution.discover(name="compass-ros", path=[sysconfig.get_path("purelib")])
    return {plain(name) for name in installed.requires or ()}


def test_every_library_that_is_imported_is_declared_and_the_other_way_round() -> None:
    firsts = {name.partition(".")[0] for path in MODULES for name in imports(ast.parse(path.read_text("utf-8")))}
    foreign = firsts - sys.stdlib_module_names - FROM_ROS - {"compass_ros"}
    owners = packages_distributions()
    imported = {plain(owners[name][0]) for name in foreign}
    assert imported == declared()


def test_every_declared_library_has_one_locked_version() -> None:
    lines = [line for line in (ROOT / "requirements.lock").read_text().splitlines() if not line.startswith("#")]
    assert all(re.fullmatch(r"[a-z0-9.-]+==[0-9][^+]*", line) for line in lines)
    locked = [line.partition("==")[0] for line in lines]
    assert len(set(locked)) == len(locked)
    assert declared() <= set(locked)
    assert "opencv-python-headless" not in locked, "it would own the same folder as opencv-python"


@pytest.mark.ros
@pytest.mark.parametrize("node", NODES)
def test_ros2_run_finds_a_stub_that_starts_the_node(node: str) -> None:
    assert (PREFIX / "share/ament_index/resource_index/packages/compass_ros").is_file()
    stub = PREFIX / "lib" / "compass_ros" / node
    assert os.access(stub, os.X_OK)
    # With a parameter that ROS cannot parse the node ends before it says anything to anybody.
    environment = os.environ | {"PATH": "/usr/bin:/bin"}
    done = subprocess.run(
        [stub, "--ros-args", "-p", "seed"], env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode
    assert f"compass_ros/nodes/{node}.py" in done.stderr
    assert "Couldn't parse parameter override rule" in done.stderr

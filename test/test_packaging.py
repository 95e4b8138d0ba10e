"""What is installed is what is needed: dependencies, versions, and the files that `ros2 run` looks for."""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
import sysconfig
from collections.abc import Iterator
from importlib.metadata import Distribution, packages_distributions
from itertools import pairwise
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


def reached_by_name(tree: ast.AST) -> Iterator[str]:
    """Modules that are reached without `import`: by a text that a loader is given, or after `-m` in a command line."""
    loaders = {
        alias.asname or alias.name
        for node in ast.walk(tree)
        if isinstance(node, ast.Import | ast.ImportFrom)
        for alias in node.names
        if (getattr(node, "module", None) or alias.name).partition(".")[0] in ("importlib", "pkgutil", "runpy")
        or alias.name == "PackageLoader"
    } | {"__import__"}
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and node.args and _root(node.func) in loaders:
            yield from _text(node.args[0])
        elif isinstance(node, ast.List | ast.Tuple | ast.Call):
            words = node.args if isinstance(node, ast.Call) else node.elts
            for flag, module in pairwise(words):
                if isinstance(flag, ast.Constant) and flag.value == "-m":
                    yield from _text(module)


def _root(function: ast.expr) -> str:
    """`resources` of `resources.files`."""
    while isinstance(function, ast.Attribute):
        function = function.value
    return function.id if isinstance(function, ast.Name) else ""


def _text(word: ast.expr) -> Iterator[str]:
    """A name that is written out; of one that is put together, what it begins with."""
    begun = word.values[0] if isinstance(word, ast.JoinedStr) else word
    if isinstance(begun, ast.Constant) and isinstance(begun.value, str):
        yield begun.value


@pytest.mark.parametrize(
    "source",
    [
        "from importlib import resources\nresources.files('plotly').joinpath('x')",
        "import importlib.resources as r\nr.files('plotly')",
        "from importlib import import_module\ndef f():\n    return import_module('plotly.io')",
        "import importlib\nimportlib.import_module(f'plotly.{name}')",
        "__import__('plotly')",
        "from importlib.util import find_spec\nfound = find_spec('plotly') is not None",
        "from importlib.metadata import version\nprint(version('plotly'))",
        "import pkgutil\npkgutil.get_data('plotly', 'package_data/plotly.min.js')",
        "from runpy import run_module\nrun_module('plotly')",
        "from jinja2 import PackageLoader\nPackageLoader('plotly')",
        "import subprocess, sys\nsubprocess.run([sys.executable, '-m', 'plotly'])",
        "start(name, '-m', f'plotly.{name}')",
    ],
)
def test_a_library_that_is_reached_by_name_is_seen(source: str) -> None:
    assert {name.partition(".")[0] for name in reached_by_name(ast.parse(source))} == {"plotly"}


def test_every_library_that_is_used_is_declared_and_the_other_way_round() -> None:
    trees = [ast.parse(path.read_text("utf-8")) for path in MODULES]
    firsts = {name.partition(".")[0] for tree in trees for name in (*imports(tree), *reached_by_name(tree))}
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
    # With a parameter that ROS cannot parse the node ends, in one line, before it says anything to anybody.
    environment = os.environ | {"PATH": "/usr/bin:/bin"}
    done = subprocess.run(
        [stub, "--ros-args", "-p", "seed"], env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode
    assert done.stderr.splitlines()[-1].startswith(f"{node}: failed to initialize rcl: Couldn't parse parameter")
    assert "Couldn't parse parameter override rule" in done.stderr

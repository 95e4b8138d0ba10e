"""What is installed is what is needed: dependencies, versions, and the files that `ros2 run` looks for."""

from __future__ import annotations

import ast
import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from importlib.metadata import packages_distributions
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree

import mujoco
import pytest
import tomllib

import compass_ros
from compass_ros.errors import ConfigError
from compass_ros.extras import EXTRAS, OF_ROS
from compass_ros.nodes import INTERFACES, MISSING
from compass_ros.simulation.native import compiled
from compass_ros.simulation.native.compiled import OPTIONS
from scripts.headers import VERSIONS
from test.test_layering import HOMES, MODULES, ROOT, imports

NODES = ("calibration_client", "calibrator", "puck_tracker", "recorder", "shooter", "virtual_cell")
FROM_ROS = {library for libraries, parts in HOMES.items() for library in libraries if "nodes" in parts}
PREFIX = Path(sys.prefix)


def plain(name: str) -> str:
    """The name of a distribution without version, extras and spelling."""
    return re.split(r"[^A-Za-z0-9._-]", name)[0].lower().replace("_", "-")


PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
APART = {"ray", "mujoco-mjx", "jax"}
"""Extras that are tested in an environment of their own, and so not locked."""


def extra(name: str) -> set[str]:
    """Libraries of an extra."""
    return {plain(library) for library in PROJECT["optional-dependencies"][name]}


def core() -> set[str]:
    """Libraries without which nothing works."""
    return {plain(library) for library in PROJECT["dependencies"]}


def declared() -> set[str]:
    """All of them."""
    return core().union(*map(extra, PROJECT["optional-dependencies"])) - APART


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
    foreign = firsts - sys.stdlib_module_names - FROM_ROS - APART - {"compass_ros"}
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


ROSDEP = {
    "jinja2": "python3-jinja2", "jsonschema": "python3-jsonschema", "matplotlib": "python3-matplotlib",
    "numpy": "python3-numpy", "opencv-python": "python3-opencv", "openpyxl": "python3-openpyxl",
    "pydantic": "python3-pydantic", "pyyaml": "python3-yaml", "rich": "python3-rich", "scipy": "python3-scipy",
    "typer": "python3-typer",
}  # fmt: skip
"""Libraries that rosdep has from Ubuntu's packages (rosdistro, rosdep/python.yaml); of others it has none, or pip's."""
STARTED = {"launch", "launch_ros", "tf2_ros", "rmw_fastrtps_cpp"}
"""Used by the launch files and by the middleware's name, not imported by the package."""


def depends(kind: str) -> set[str]:
    return {one.text or "" for one in ElementTree.parse(ROOT / "package.xml").findall(kind)}


def test_package_xml_names_all_that_is_imported_and_all_that_rosdep_has() -> None:
    firsts = {name.partition(".")[0] for path in MODULES for name in imports(ast.parse(path.read_text("utf-8")))}
    on_a_robot = core() | extra("ros") | extra("report")
    expected = (firsts & FROM_ROS) | STARTED | {ROSDEP[name] for name in on_a_robot & ROSDEP.keys()}
    assert depends("exec_depend") == expected


def test_package_xml_names_what_only_tests_import() -> None:
    tests = [path for path in (ROOT / "test").rglob("*.py") if path.name != "test_launch.py"]
    firsts = {name.partition(".")[0] for path in tests for name in imports(ast.parse(path.read_text("utf-8")))}
    ours = depends("exec_depend")
    assert depends("test_depend") == {name for name in firsts if name.endswith("_msgs") and name not in ours}


@pytest.mark.ros
def test_colcon_finds_both_packages_as_the_docs_say_and_puts_compass_on_the_path(tmp_path: Path) -> None:
    """One command after the clone; then everything under `src` is found. The interfaces are not built anew here."""
    workspace, clone = tmp_path, tmp_path / "src" / "compass_ros"
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, check=True, capture_output=True, text=True).stdout.split(
        "\n"
    )
    left = ("", "bags", "test", "docs", "proof", "examples", "benchmarks")
    for name in (name for name in listed if name.split("/")[0] not in left and (ROOT / name).exists()):
        (clone / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(ROOT / name, clone / name)
    command = next(line for line in (ROOT / "docs" / "install.md").read_text().splitlines() if line.startswith("ln -s"))
    assert command in MISSING[INTERFACES]
    subprocess.run(shlex.split(command), cwd=workspace, check=True)
    built = workspace / "install" / INTERFACES / "share" / INTERFACES
    built.mkdir(parents=True)
    (built / "package.sh").touch()
    environment = os.environ | {"AMENT_PREFIX_PATH": str(PREFIX), "PATH": f"{PREFIX / 'bin'}:{os.environ['PATH']}"}

    def run(*words: str) -> str:
        done = subprocess.run(words, cwd=workspace, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    colcon = (sys.executable, "-m", "colcon")
    assert {line.split("\t")[0] for line in run(*colcon, "list").splitlines()} == {"compass_ros", INTERFACES}
    run(*colcon, "build", "--packages-select", "compass_ros")
    found = run("bash", "-c", ". install/setup.bash && command -v compass && compass --version")
    assert found.splitlines()[0] == str(workspace / "install" / "compass_ros" / "bin" / "compass")
    nodes = workspace / "install" / "compass_ros" / "lib" / "compass_ros"
    assert {path.name for path in nodes.iterdir()} == set(NODES), "what `ros2 run` finds"


@pytest.mark.ros
@pytest.mark.parametrize("missing", sorted(MISSING))
@pytest.mark.parametrize("node", ["recorder", "calibrator", "shooter"])
def test_a_node_without_its_messages_says_what_to_run(missing: str, node: str) -> None:
    code = (
        "import importlib.util, runpy\n"
        "found = importlib.util.find_spec\n"
        f"importlib.util.find_spec = lambda name, *rest: None if name == {missing!r} else found(name, *rest)\n"
        f"runpy.run_module('compass_ros.nodes.{node}', run_name='__main__')\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr == f"compass_ros: {MISSING[missing]}\n"


def test_versions_and_maintainers_stand_once() -> None:
    for manifest in ("package.xml", "msg_schemas/package.xml"):
        read = ElementTree.parse(ROOT / manifest)
        assert read.findtext("version") == compass_ros.__version__
        assert read.findtext("license") == PROJECT["license"]
        assert read.find("maintainer") is not None
    assert "version" in PROJECT["dynamic"], "compass_ros.__version__ is the one place"


def test_a_wheel_compiles_as_every_other_installation() -> None:
    """The options of the two compilations, and the versions of MuJoCo that a wheel has forces for."""
    setup = ast.parse((ROOT / "setup.py").read_text(encoding="utf-8"))
    (options,) = (
        ast.literal_eval(node.value)
        for node in setup.body
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "OPTIONS"
    )
    assert tuple(options) == OPTIONS
    needed = next(line for line in PROJECT["dependencies"] if plain(line) == "mujoco")
    low, high = VERSIONS[0].rpartition(".")[0], VERSIONS[-1].split(".")
    assert needed == f"mujoco>={low},<{high[0]}.{int(high[1]) + 1}"


def test_forces_are_compiled_where_no_shipped_library_fits(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_HOME", str(tmp_path))
    monkeypatch.setattr(compiled, "headers_of", lambda path: None)
    made = compiled.compiled_forces()
    assert made.is_relative_to(tmp_path)
    monkeypatch.undo()
    assert compiled.headers_of(made) == mujoco.mj_version()
    monkeypatch.setenv("ROS_HOME", str(tmp_path / "other"))
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)
    with pytest.raises(ConfigError, match=r"no compiled forces for MuJoCo .*, and no C compiler"):
        compiled.compile_forces(Path(mujoco.__file__).parent / "include")


# What an installation without extras is: nothing that only extras bring can be imported.
WITHOUT = """
import importlib.abc, sys
class Without(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {missing}:
            raise ModuleNotFoundError("No module named " + repr(name), name=name)
sys.meta_path.insert(0, Without())
from compass_ros.cli import main
sys.argv = ["compass", *{words}]
main()
"""


def without_extras(*words: object) -> subprocess.CompletedProcess[str]:
    """A command line where no library of an extra is installed."""
    missing = {*EXTRAS, "rclpy", "compass_ros_interfaces"}
    code = WITHOUT.format(missing=missing, words=[str(word) for word in words])
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)


def test_the_core_makes_bags_into_a_report(tmp_path: Path) -> None:
    bags = [ROOT / "examples" / "own_cell" / "bags" / f"swing_{number}" for number in (1, 2, 3)]
    cell = ("--cell", ROOT / "examples" / "own_cell" / "pendulum.yaml")
    done = without_extras("calibrate", *cell, "--no-discover", "--progress", "none", "--out", tmp_path, *bags)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "report.html").stat().st_size > 1e6
    said = without_extras("diagnose", tmp_path)
    assert said.returncode == 1
    assert "Missing physics was not looked for" in " ".join(said.stdout.split())
    assert not (tmp_path / "figures").exists()
    assert said.stderr == "compass: needs matplotlib, which is not installed: pip install 'compass_ros[report]'\n"


@pytest.mark.parametrize(
    ("words", "library", "brings"),
    [
        (("policy", "RESULT"), "torch", "policy"),
        (("track", "film.mp4", "--camera", "camera.yaml"), "cv2", "track"),
    ],
)
def test_a_command_says_which_extra_it_needs(words: tuple[str, ...], library: str, brings: str) -> None:
    done = without_extras(*words)
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr == f"compass: needs {library}, which is not installed: pip install 'compass_ros[{brings}]'\n"


def test_every_library_of_an_extra_has_its_advice() -> None:
    """The table of advice is that of pyproject.toml, by the names that are imported."""
    owners = packages_distributions()
    for module, name in EXTRAS.items():
        if module in OF_ROS:
            continue
        assert (plain(owners[module][0]) if module in owners else module) in extra(name)
    only = set().union(*map(extra, PROJECT["optional-dependencies"])) - core() - APART
    assert only == {plain(owners[module][0]) for module in EXTRAS if module in owners and module not in OF_ROS}


def test_the_package_is_imported_in_no_time() -> None:
    code = (
        "import sys, time; begun = time.perf_counter(); import compass_ros; print(time.perf_counter() - begun);"
        "assert 'numpy' not in sys.modules"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert float(done.stdout) < 0.3

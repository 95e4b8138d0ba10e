"""Build the package `compass_ros_interfaces` from the ROS wheels of this environment and install it there.

Run with the environment's Python. Needs cmake and gcc. The package is compiled as on a robot (ament_cmake, rosidl),
then packed as a wheel whose libraries land in the environment's `lib/` and `share/`, where the loader and the ament
index look: the interfaces then need no environment variable. Does nothing when these sources are installed already.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from pathlib import Path
from xml.etree import ElementTree

ROOT = Path(__file__).resolve().parent.parent
SOURCES = ROOT / "msg_schemas"
PREFIX = Path(sys.prefix)
NAME = "compass_ros_interfaces"
FORMER = "compass_interfaces"
"""The name in version 0.1. A released ROS package of another project has it."""
MARK = Path("share") / NAME / "sources.sha256"
"""Installed with the package: which sources it was built from."""


def fingerprint() -> str:
    """Hash of everything that the built package depends on: the sources and the Python it is built for."""
    digest = hashlib.sha256(sys.version.encode())
    files = sorted(path for path in SOURCES.rglob("*") if path.is_file())
    for path in (*files, ROOT / "scripts" / "wheel_targets.cmake"):
        digest.update(path.relative_to(ROOT).as_posix().encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()


def compile_package(build: Path, stage: Path) -> None:
    """Configure, compile and install the package under `stage`."""
    python = sysconfig.get_path("include")
    environment = os.environ | {"AMENT_PREFIX_PATH": str(PREFIX), "CMAKE_PREFIX_PATH": str(PREFIX)}
    environment["PATH"] = f"{PREFIX / 'bin'}{os.pathsep}{os.environ['PATH']}"
    configure = [
        "cmake", "-S", str(SOURCES), "-B", str(build), "-DCMAKE_BUILD_TYPE=Release", "-DBUILD_TESTING=OFF",
        f"-DCMAKE_INSTALL_PREFIX={stage}", f"-DCMAKE_PROJECT_INCLUDE={ROOT / 'scripts' / 'wheel_targets.cmake'}",
        f"-DPython3_EXECUTABLE={sys.executable}", f"-DPython3_INCLUDE_DIR={python}",
    ]  # fmt: skip
    jobs = str(os.cpu_count() or 1)
    for command in (configure, ["cmake", "--build", str(build), "-j", jobs], ["cmake", "--install", str(build)]):
        done = subprocess.run(command, check=False, env=environment, text=True, capture_output=True)
        if done.returncode:
            output = done.stdout + done.stderr
            raise SystemExit(f"{output}\n{' '.join(command)}: failed with status {done.returncode}")


def pack_wheel(stage: Path, tree: Path) -> Path:
    """Arrange what CMake installed as a wheel: the Python package at its top, all else under the data scheme."""
    version = ElementTree.parse(SOURCES / "package.xml").findtext("version")
    modules = next(stage.glob(f"lib/python3*/site-packages/{NAME}"))
    shutil.move(modules, tree / NAME)
    shutil.rmtree(modules.parent.parent)  # what is left there is metadata of the development install
    shutil.move(stage, tree / f"{NAME}-{version}.data" / "data")
    info = tree / f"{NAME}-{version}.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {NAME}\nVersion: {version}\nLicense: Apache-2.0\n")
    tag = f"cp{sys.version_info.major}{sys.version_info.minor}"
    platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
    (info / "WHEEL").write_text(
        f"Wheel-Version: 1.0\nGenerator: {NAME}\nRoot-Is-Purelib: false\nTag: {tag}-{tag}-{platform}\n"
    )
    packed = [sys.executable, "-m", "wheel", "pack", str(tree), "--dest-dir", str(tree.parent)]
    subprocess.run(packed, check=True, stdout=subprocess.DEVNULL)
    return next(tree.parent.glob("*.whl"))


def remove_former() -> None:
    """Uninstall what version 0.1 of this script installed."""
    if any(found.name == FORMER for found in importlib.metadata.distributions()):
        subprocess.run([sys.executable, "-m", "pip", "uninstall", "--quiet", "--yes", FORMER], check=True)


def main() -> None:
    remove_former()
    mark = PREFIX / MARK
    wanted = fingerprint()
    if mark.is_file() and mark.read_text() == wanted:
        print(f"{NAME} is up to date")
        return
    print(f"building {NAME} (20 s or so)", flush=True)
    with tempfile.TemporaryDirectory(prefix=f"{NAME}-") as folder:
        stage, tree = Path(folder, "stage"), Path(folder, "tree")
        tree.mkdir()
        compile_package(Path(folder, "build"), stage)
        (stage / MARK).write_text(wanted)
        wheel = pack_wheel(stage, tree)
        pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index", "--force-reinstall"]
        subprocess.run([*pip, str(wheel)], check=True)
    print(f"installed {NAME} into {PREFIX}")


if __name__ == "__main__":
    main()

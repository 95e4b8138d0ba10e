"""Build the interface packages that no wheel brings, from the ROS wheels of this environment, and install them there.

Run with the environment's Python. Needs cmake and gcc. A package is compiled as on a robot (ament_cmake, rosidl), then
packed as a wheel whose libraries land in the environment's `lib/` and `share/`, where the loader and the ament index
look: the interfaces then need no environment variable. Does nothing where these sources are installed already.
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
PACKAGES = (ROOT / "scripts" / "tf2_msgs", ROOT / "msg_schemas")
"""Sources; a package of another project comes with apt on a robot, and of it only what is used here."""
TARGETS = ROOT / "scripts" / "wheel_targets.cmake"
PREFIX = Path(sys.prefix)
FORMER = "compass_interfaces"
"""The name of our interfaces in version 0.1. A released ROS package of another project has it."""


def described(sources: Path, field: str) -> str:
    """A field of a package.xml: name, version, license."""
    return str(ElementTree.parse(sources / "package.xml").findtext(field))


def mark(name: str) -> Path:
    """Installed with a package: which sources it was built from."""
    return Path("share", name, "sources.sha256")


def fingerprint(sources: Path) -> str:
    """Hash of everything that a built package depends on: its sources and the Python it is built for."""
    digest = hashlib.sha256(sys.version.encode())
    files = sorted(path for path in sources.rglob("*") if path.is_file())
    for path in (*files, TARGETS):
        digest.update(path.relative_to(ROOT).as_posix().encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()


def compile_package(sources: Path, build: Path, stage: Path) -> None:
    """Configure, compile and install the package under `stage`."""
    python = sysconfig.get_path("include")
    environment = os.environ | {"AMENT_PREFIX_PATH": str(PREFIX), "CMAKE_PREFIX_PATH": str(PREFIX)}
    environment["PATH"] = f"{PREFIX / 'bin'}{os.pathsep}{os.environ['PATH']}"
    configure = [
        "cmake", "-S", str(sources), "-B", str(build), "-DCMAKE_BUILD_TYPE=Release", "-DBUILD_TESTING=OFF",
        f"-DCMAKE_INSTALL_PREFIX={stage}", f"-DCMAKE_PROJECT_INCLUDE={TARGETS}",
        f"-DPython3_EXECUTABLE={sys.executable}", f"-DPython3_INCLUDE_DIR={python}",
    ]  # fmt: skip
    jobs = str(os.cpu_count() or 1)
    for command in (configure, ["cmake", "--build", str(build), "-j", jobs], ["cmake", "--install", str(build)]):
        done = subprocess.run(command, check=False, env=environment, text=True, capture_output=True)
        if done.returncode:
            output = done.stdout + done.stderr
            raise SystemExit(f"{output}\n{' '.join(command)}: failed with status {done.returncode}")


def pack_wheel(sources: Path, stage: Path, tree: Path) -> Path:
    """Arrange what CMake installed as a wheel: the Python package at its top, all else under the data scheme."""
    name, version, terms = (described(sources, field) for field in ("name", "version", "license"))
    modules = next(stage.glob(f"lib/python3*/site-packages/{name}"))
    shutil.move(modules, tree / name)
    shutil.rmtree(modules.parent.parent)  # what is left there is metadata of the development install
    shutil.move(stage, tree / f"{name}-{version}.data" / "data")
    info = tree / f"{name}-{version}.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\nLicense: {terms}\n")
    tag = f"cp{sys.version_info.major}{sys.version_info.minor}"
    platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
    (info / "WHEEL").write_text(
        f"Wheel-Version: 1.0\nGenerator: {name}\nRoot-Is-Purelib: false\nTag: {tag}-{tag}-{platform}\n"
    )
    packed = [sys.executable, "-m", "wheel", "pack", str(tree), "--dest-dir", str(tree.parent)]
    subprocess.run(packed, check=True, stdout=subprocess.DEVNULL)
    return next(tree.parent.glob("*.whl"))


def install(sources: Path) -> None:
    """Build a package and install it, where what is installed is not of these sources."""
    name, wanted = described(sources, "name"), fingerprint(sources)
    installed = PREFIX / mark(name)
    if installed.is_file() and installed.read_text() == wanted:
        print(f"{name} is up to date")
        return
    print(f"building {name} (20 s or so)", flush=True)
    with tempfile.TemporaryDirectory(prefix=f"{name}-") as folder:
        stage, tree = Path(folder, "stage"), Path(folder, "tree")
        tree.mkdir()
        compile_package(sources, Path(folder, "build"), stage)
        (stage / mark(name)).write_text(wanted)
        wheel = pack_wheel(sources, stage, tree)
        pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index", "--force-reinstall"]
        subprocess.run([*pip, str(wheel)], check=True)
    print(f"installed {name} into {PREFIX}")


def remove_former() -> None:
    """Uninstall what version 0.1 of this script installed."""
    if any(found.name == FORMER for found in importlib.metadata.distributions()):
        subprocess.run([sys.executable, "-m", "pip", "uninstall", "--quiet", "--yes", FORMER], check=True)


def main() -> None:
    remove_former()
    for sources in PACKAGES:
        install(sources)


if __name__ == "__main__":
    main()

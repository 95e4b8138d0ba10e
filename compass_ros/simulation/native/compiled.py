"""Which compiled library of forces fits the MuJoCo that is installed: a shipped one, or one that is compiled now.

The structures that fields.c reads have another layout in every release of MuJoCo. A wheel brings a library for each
release that was tried; for another one the source is compiled against the headers that MuJoCo's own wheel brings.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import platform
import shutil
import subprocess
import tempfile
from pathlib import Path

import mujoco

from compass_ros.errors import ConfigError
from compass_ros.places import data_home

FOLDER = Path(__file__).parent
SOURCES = ("fields.c", "pairs.h", "sliding.h", "drives.h")
OPTIONS = ("-O2", "-ffp-contract=off")
"""Same bits on every machine: no fused operations. As in setup.py, which a test holds."""


def compiled_forces() -> Path:
    """A library for this version of MuJoCo. Raises ConfigError where there is none and no C compiler."""
    version = mujoco.mj_versionString().replace(".", "_")
    for path in (FOLDER / "_fields.so", FOLDER / f"_fields_{version}.so"):
        if headers_of(path) == mujoco.mj_version():
            return path
    return compile_forces(Path(mujoco.__file__).parent / "include")


def headers_of(path: Path) -> int | None:
    """mj_version() of the MuJoCo that a library was compiled for; None where it is not there or does not say."""
    if not path.exists():
        return None
    library = ctypes.CDLL(str(path))
    try:
        return int(library.compass_headers())
    except AttributeError:
        return None


def compile_forces(include: Path) -> Path:
    """Compile for the installed MuJoCo, once: the library is kept in the suite's folder of data."""
    digest = hashlib.sha256(f"{mujoco.mj_versionString()} {platform.machine()} {OPTIONS}".encode())
    for name in SOURCES:
        digest.update((FOLDER / name).read_bytes())
    path = data_home() / "native" / f"_fields_{digest.hexdigest()[:16]}.so"
    if path.exists():
        return path
    compiler = os.environ.get("CC") or shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None or not include.is_dir():
        shipped = [found.stem.removeprefix("_fields_").replace("_", ".") for found in FOLDER.glob("_fields_*.so")]
        raise ConfigError(
            f"no compiled forces for MuJoCo {mujoco.mj_versionString()}, and no C compiler to make them: install one "
            f"(gcc), or one of the versions that are shipped: {', '.join(sorted(shipped)) or 'none'}"
        )
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=path.parent) as folder:
        made = Path(folder) / path.name
        words = [compiler, "-shared", "-fPIC", *OPTIONS, f"-I{include}", str(FOLDER / "fields.c"), "-o", str(made)]
        done = subprocess.run([*words, "-lm"], capture_output=True, text=True, check=False)
        if done.returncode:
            said = next((line for line in done.stderr.splitlines() if "error" in line), done.stderr[:200])
            raise ConfigError(f"forces do not compile for MuJoCo {mujoco.mj_versionString()}: {said}")
        made.replace(path)
    return path

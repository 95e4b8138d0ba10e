"""What of the package needs code; everything else is in pyproject.toml. For pip and for colcon (ament_python)."""

from __future__ import annotations

import os
import sys
from importlib.util import find_spec
from pathlib import Path

from setuptools import Extension, find_packages, setup
from setuptools.command.bdist_wheel import bdist_wheel
from setuptools.command.build_ext import build_ext

NAME = "compass_ros"
ROOT = Path(__file__).parent
NATIVE = Path(NAME, "simulation", "native")
OPTIONS = ["-O2", "-ffp-contract=off"]
"""As in simulation/native/compiled.py."""


class PlainLibrary(build_ext):
    """Names the libraries `_fields*.so`: they are no Python modules and depend on no version of Python."""

    def get_ext_filename(self, fullname: str) -> str:
        return str(Path(*fullname.split(".")).with_suffix(".so"))


class AnyPython(bdist_wheel):
    """One wheel for every Python 3 of a machine."""

    def get_tag(self) -> tuple[str, str, str]:
        return "py3", "none", super().get_tag()[2]


def native() -> list[Extension]:
    """The forces as a compiled MuJoCo callback; plain libraries, loaded by path and not imported.

    For the MuJoCo that is installed, as `_fields.so`; where COMPASS_HEADERS names a folder of `scripts/headers.py`, for
    each version in it.
    """
    headers = os.environ.get("COMPASS_HEADERS")
    if headers:
        found = {f"_fields_{path.name.replace('.', '_')}": path for path in sorted(Path(headers).iterdir())}
    else:
        mujoco = find_spec("mujoco")
        if mujoco is None or mujoco.origin is None:
            raise SystemExit("setup.py: compass_ros is compiled against mujoco: pip install -r requirements.lock first")
        found = {"_fields": Path(mujoco.origin).parent / "include"}
    depends = [str(NATIVE / name) for name in ("pairs.h", "sliding.h", "drives.h", "program.py")]
    return [
        Extension(
            f"{NAME}.simulation.native.{name}",
            [str(NATIVE / "fields.c")],
            include_dirs=[str(include)],
            extra_compile_args=OPTIONS,
            depends=depends,
            libraries=["m"],
        )
        for name, include in found.items()
    ]


def shared(folder: str) -> list[tuple[str, list[str]]]:
    """The files of a top folder, for share/compass_ros, in the same tree. The cells are in the package already."""
    files = sorted(path.relative_to(ROOT) for path in (ROOT / folder).rglob("*") if path.is_file())
    files = [path for path in files if not {"__pycache__", "cells"} & set(path.parts)]
    return [(f"share/{NAME}/{path.parent}", [str(path)]) for path in files]


sys.path.insert(0, str(ROOT))  # pyproject.toml asks the package for its version
setup(
    name=NAME,
    python_requires=">=3.11",
    # The cells travel inside the package, where the core finds them without ROS.
    packages=[*find_packages(include=[NAME, f"{NAME}.*"]), f"{NAME}.config.cells"],
    package_dir={f"{NAME}.config.cells": "config/cells"},
    ext_modules=native(),
    cmdclass={"build_ext": PlainLibrary, "bdist_wheel": AnyPython},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        # What `ros2 run compass_ros NODE` looks for. colcon and pip both take them from here.
        (f"lib/{NAME}", sorted(str(path.relative_to(ROOT)) for path in (ROOT / "resource" / "bin").iterdir())),
        *shared("config"),
        *shared("launch"),
    ],
)

"""compass_ros for pip and for colcon (ament_python): one package, two installers."""

from importlib.util import find_spec
from pathlib import Path

from setuptools import Extension, find_packages, setup
from setuptools.command.build_ext import build_ext

NAME = "compass_ros"
ROOT = Path(__file__).parent


class PlainLibrary(build_ext):
    """Names the library `_fields.so`: it is no Python module and depends on no version of Python."""

    def get_ext_filename(self, fullname: str) -> str:
        return str(Path(*fullname.split(".")).with_suffix(".so"))


def native() -> list[Extension]:
    """The table's forces as a compiled MuJoCo callback; a plain library, loaded by path and not imported."""
    mujoco = find_spec("mujoco")
    if mujoco is None or mujoco.origin is None:
        raise SystemExit("setup.py: compass_ros is compiled against mujoco: pip install -r requirements.lock first")
    include = Path(mujoco.origin).parent / "include"
    source = str(Path(NAME, "simulation", "native", "fields.c"))
    options = ["-O2", "-ffp-contract=off"]  # same bits on every machine: no fused operations
    name = f"{NAME}.simulation.native._fields"
    return [Extension(name, [source], include_dirs=[str(include)], extra_compile_args=options)]


def shared(folder: str) -> list[tuple[str, list[str]]]:
    """The files of a top folder, for share/compass_ros, in the same tree. The cells are in the package already."""
    files = sorted(path.relative_to(ROOT) for path in (ROOT / folder).rglob("*") if path.is_file())
    files = [path for path in files if not {"__pycache__", "cells"} & set(path.parts)]
    return [(f"share/{NAME}/{path.parent}", [str(path)]) for path in files]


setup(
    name=NAME,
    version="0.1.0",
    description="Calibrates robot simulators from recorded trajectories and discovers the physics that they lack",
    license="Apache-2.0",
    license_files=["LICENSE"],
    python_requires=">=3.10",
    # The cells travel inside the package, where the core finds them without ROS.
    packages=[*find_packages(include=[NAME, f"{NAME}.*"]), f"{NAME}.config.cells"],
    package_dir={f"{NAME}.config.cells": "config/cells"},
    package_data={
        NAME: ["py.typed", "**/*.json", "**/*.j2", "**/*.css", "**/*.js", "**/*.c", "**/*.h"],
        f"{NAME}.config.cells": ["*.yaml", "*.xml"],
    },
    ext_modules=native(),
    cmdclass={"build_ext": PlainLibrary},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        # What `ros2 run compass_ros NODE` looks for. colcon and pip both take them from here.
        (f"lib/{NAME}", sorted(str(path.relative_to(ROOT)) for path in (ROOT / "resource" / "bin").iterdir())),
        *shared("config"),
        *shared("launch"),
    ],
    zip_safe=False,
    # ROS itself is not named here: on a robot it comes from apt, elsewhere from requirements.lock.
    install_requires=[
        "annotated-types",
        "cma",
        "jinja2",
        "jsonschema",
        "lz4",
        "markupsafe",
        "matplotlib",
        "mcap",
        "mujoco>=3.9,<3.10",
        "numba",  # the concealed arms: equations of motion, compiled
        "numpy",
        "opencv-python",
        "openpyxl",
        "plotly",  # its bundle of JavaScript goes into the report
        "pydantic>=2",
        "pysindy<2",  # 2 wants numpy 2, which mink, and so robosuite, does not take
        "pyyaml",
        "rich",
        "robosuite",
        "rosbags",
        "sbi",
        "scikit-learn<1.8",  # pysindy 1.7 calls what 1.8 took away
        "scipy",
        "threadpoolctl",
        "torch",
        "typer",
        "zstandard",
    ],
    entry_points={"console_scripts": ["compass = compass_ros.cli:main"]},
)

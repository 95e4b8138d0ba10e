"""Print the version of every package in this environment, for requirements.lock.

`pip freeze` alone would also name the Python modules inside the ROS wheels, which no index offers. Left out are this
project's own packages, and the local part of a version (`2.13.0+cpu`), which only one machine's index may have.
"""

from __future__ import annotations

from importlib.metadata import distributions

OWN = {"compass-ros", "compass-interfaces", "pip"}

HEADER = """\
# Every version that the suite was tested with, Python 3.11. Written by `make lock`, after a green `make test`.
# One OpenCV only: opencv-python (robosuite asks for it; opencv-python-headless would own the same folder).
"""


def main() -> None:
    pins = set()
    for found in distributions():
        name = found.metadata["Name"].replace("_", "-").lower()
        # A wheel leaves a RECORD; what CMake installed inside another wheel leaves an egg-info without one.
        if name not in OWN and found.read_text("RECORD") is not None:
            pins.add(f"{name}=={found.version.partition('+')[0]}")
    print(HEADER + "\n".join(sorted(pins)))


if __name__ == "__main__":
    main()

"""Fetch the headers of every MuJoCo that a wheel is compiled for, from MuJoCo's own wheels. Needs pip and PyPI.

`python scripts/headers.py FOLDER` writes FOLDER/VERSION/mujoco/*.h, which COMPASS_HEADERS=FOLDER gives to setup.py.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

VERSIONS = ("3.9.0", "3.10.0", "3.11.0", "3.12.0", "3.13.0", "3.14.0", "3.15.0", "3.16.0", "3.17.0", "4.0.0")
"""Those that docs/engines.md lists."""
BY_PARTS = 4
"""From this version on the headers are in a wheel of their own."""


def fetch(version: str, out: Path) -> None:
    """The headers of one version, under out/version/mujoco."""
    name = "mujoco-core" if int(version.partition(".")[0]) >= BY_PARTS else "mujoco"
    with tempfile.TemporaryDirectory() as folder:
        pip = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--only-binary", ":all:", "-d", folder]
        subprocess.run([*pip, f"{name}=={version}"], check=True)
        (wheel,) = Path(folder).glob("*.whl")
        with zipfile.ZipFile(wheel) as packed:
            headers = [one for one in packed.namelist() if "/include/mujoco/" in one and one.endswith(".h")]
            for header in headers:
                path = out / version / "mujoco" / header.rpartition("/")[2]
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(packed.read(header))
    print(f"MuJoCo {version}: {len(headers)} headers")


def main() -> None:
    (given,) = sys.argv[1:]
    for version in VERSIONS:
        if not (Path(given) / version).is_dir():
            fetch(version, Path(given))


if __name__ == "__main__":
    main()

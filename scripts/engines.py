"""The same calibrations on the oldest and the newest MuJoCo and numpy that are allowed; a table of what differs.

    python scripts/engines.py --out out/engines                       # oldest, newest, and each of the two alone
    python scripts/engines.py --out out/engines --pair 3.13.0 2.4.6   # others
    python scripts/engines.py --out out/engines --tests               # also the tests of forces and cells on each

Each pair has a virtual environment of its own, made with pip, with the core of this package compiled for it: torch, ROS
and robosuite are not there. Differences are in error bars of the first pair.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
PAIRS = (("3.9.0", "1.26.4"), ("3.9.0", "2.4.6"), ("3.17.0", "2.4.6"), ("4.0.0", "1.26.4"), ("4.0.0", "2.4.6"))
TESTS = ("test/simulation/effects", "test/simulation/test_kicks.py", "test/simulation/test_export.py", "test/cells")
WITHOUT = ("test/cells/test_robosuite.py", "test/cells/test_robots.py", "test/cells/test_scene_files.py")
"""Tests that need robosuite, or the models that it brings."""
FOR_TESTS = ("pytest", "hypothesis", "jaxtyping", "opencv-python-headless")


@dataclass(frozen=True)
class Case:
    """A calibration that ships with the sources."""

    name: str
    cell: str
    bags: str
    options: tuple[str, ...] = ()


CASES = (
    Case("pendulum", "examples/own_cell/pendulum.yaml", "examples/own_cell/bags"),
    Case("air hockey", "air_hockey", "bags", ("--no-discover", "--held-out", "0")),
)


def environment(out: Path, mujoco: str, numpy: str, tests: bool) -> Path:
    """The Python of a pair's environment, made where it is not there."""
    folder = out / f"mujoco-{mujoco}-numpy-{numpy}"
    python = folder / "bin" / "python"
    if not (folder / "made").exists():
        subprocess.run([sys.executable, "-m", "venv", str(folder)], check=True)
        pip = [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
        pins = [f"mujoco=={mujoco}", f"numpy=={numpy}"]
        subprocess.run([*pip, "setuptools>=77", "wheel", *pins], check=True)
        subprocess.run([*pip, "--no-build-isolation", str(ROOT), *pins], check=True)
        (folder / "made").touch()
    if tests:
        subprocess.run([str(python), "-m", "pip", "install", "--quiet", *FOR_TESTS, f"numpy=={numpy}"], check=True)
    return python


def run(python: Path, case: Case, out: Path) -> tuple[dict[str, Any], float]:
    """Its result and how long it took [s]."""
    begun = time.monotonic()
    words = ["-m", "compass_ros.cli", "calibrate", "--cell", case.cell, "--out", str(out), "--progress", "none"]
    elsewhere = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"} | {"MUJOCO_GL": "disable"}
    cell = str(ROOT / case.cell) if (ROOT / case.cell).exists() else case.cell
    words[4] = cell
    command = [str(python), *words, *case.options, str(ROOT / case.bags)]
    subprocess.run(command, cwd=out.parent, env=elsewhere, check=True, stdout=subprocess.DEVNULL)
    return json.loads((out / "result.json").read_text(encoding="utf-8")), time.monotonic() - begun


def farthest(first: dict[str, Any], other: dict[str, Any]) -> tuple[float, str, int]:
    """The largest difference of an identifiable parameter in error bars of the first, whose, and among how many."""
    worst, name, count = 0.0, "", 0
    after = {row["name"]: row for row in other["parameters"]}
    for row in first["parameters"]:
        if row["identifiable"] and row["std"]:
            count += 1
            apart = abs(after[row["name"]]["value"] - row["value"]) / row["std"]
            if apart > worst:
                worst, name = apart, row["name"]
    return worst, name, count


def held_out(result: dict[str, Any]) -> float:
    """The best model's error in mm (or mrad): of held-out episodes, or of the fitted ones where none are."""
    gap = result["gap"]
    model = gap["with_effects"] or gap["calibrated"]
    return 1e3 * float((model["held_out"] or model["fit"])["rmse_m"])


def main() -> None:
    asked = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    asked.add_argument("--out", type=Path, default=Path("out/engines"))
    asked.add_argument("--pair", nargs=2, action="append", metavar=("MUJOCO", "NUMPY"))
    asked.add_argument("--tests", action="store_true")
    given = asked.parse_args()
    out = given.out.resolve()
    out.mkdir(parents=True, exist_ok=True)
    first: dict[str, dict[str, Any]] = {}
    print("| MuJoCo | numpy | case | farthest parameter [error bars] | error [1e-3] | verdict | s |")
    print("|---|---|---|---|---|---|---|")
    for mujoco, numpy in given.pair or PAIRS:
        python = environment(out, mujoco, numpy, given.tests)
        for case in CASES:
            result, took = run(python, case, out / f"{case.name.replace(' ', '_')}-{mujoco}-{numpy}")
            base = first.setdefault(case.name, result)
            apart, name, count = farthest(base, result)
            which = f"{apart:.3f} ({name}, of {count})" if name else f"0, to the last bit (of {count})"
            said = result["mismatch"]["verdict"]
            print(
                f"| {mujoco} | {numpy} | {case.name} | {which} | {held_out(result):.4f} | {said} | {took:.0f} |",
                flush=True,
            )
        if given.tests:
            words = [str(python), "-m", "pytest", "-q", "-p", "no:cacheprovider", "-m", "not slow", *TESTS]
            words += [f"--ignore={path}" for path in WITHOUT]
            done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)
            print(f"| {mujoco} | {numpy} | tests | | | {done.stdout.strip().splitlines()[-1]} | |", flush=True)


if __name__ == "__main__":
    main()

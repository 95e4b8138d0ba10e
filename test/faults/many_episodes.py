"""Calibrates from a thousand episodes, as `compass calibrate` does, and measures time and memory.

python -m test.faults.many_episodes [EPISODES] [OPTION...]        default: 1000; options go to `compass calibrate`
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from test.nodes.recordings import record

TRUTH = {"puck1@dyna@friction_sliding": 0.1, "env@camera@bias_x": 0.02}
ONE_WRITING = 50
"""Episodes that are simulated at once."""


def write(folder: Path, count: int) -> None:
    """So many different shots of one table."""
    for first in range(0, count, ONE_WRITING):
        record(folder / f"{first:05d}", TRUTH, min(ONE_WRITING, count - first), seed=first)


def main(count: int = 1000, *options: str) -> int:
    """Status 1 where a planted value is missed by more than a twentieth."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write(folder / "bags", count)
        bags = sorted(map(str, (folder / "bags").iterdir()))
        words = [sys.executable, "-m", "compass_ros.cli", "calibrate", "--out", str(folder / "out")]
        began = time.monotonic()
        subprocess.run([*words, "--progress", "none", *options, *bags], check=True)
        seconds = time.monotonic() - began
        result = json.loads((folder / "out" / "result.json").read_text())
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    found = {row["name"]: row["value"] for row in result["parameters"]}
    used = len(result["episodes"]["fit"]) + len(result["episodes"]["held_out"])
    print(
        f"{count} episodes, {used} used: {seconds:.0f} s, {spent.ru_utime + spent.ru_stime:.0f} s of processor time, "
        f"at most {spent.ru_maxrss / 1024:.0f} MiB, load average {os.getloadavg()[1]:.1f}"
    )
    print("\n".join(result["warnings"]))
    for parameter, value in TRUTH.items():
        print(f"{parameter}: planted {value}, found {found[parameter]:.5g}")
    return int(any(abs(found[p] / value - 1) > 0.05 for p, value in TRUTH.items()))


if __name__ == "__main__":
    raise SystemExit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 1000, *sys.argv[2:]))

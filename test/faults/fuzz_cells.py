"""Calibrates cells drawn at random, with discovery: each ends in a result or in one line, whatever the cell is.

python -m test.faults.fuzz_cells [COUNT] [FIRST_SEED]        default: 200 cells from seed 0; a nightly job
"""

from __future__ import annotations

import collections
import json
import math
import os
import sys
import tempfile
import time
import traceback
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from compass_ros.commands.calibrate import ProgressStyle, run
from compass_ros.errors import CompassError
from test.faults.random_cells import FULL, Size, drawn, recorded

CONFIG = {"threads": 1}


@dataclass(frozen=True)
class Ended:
    """How a calibration ended."""

    verdict: str
    """Of a result; `refused` where it ended in one line."""
    said: str = ""


def attempt(folder: Path, seed: int, size: Size = FULL) -> Ended:
    """Draw a cell, record it, calibrate it. Exceptions other than the suite's own are bugs."""
    try:
        cell = drawn(folder, seed, size)
        recorded(cell, seed, folder / "bags", size)
        run([str(folder / "bags")], str(folder / "cell.yaml"), folder / "out", CONFIG, ProgressStyle.none, "")
    except CompassError as error:
        said = str(error)
        assert "\n" not in said, said
        assert len(said) < 500, said
        return Ended("refused", said)
    result = json.loads((folder / "out" / "result.json").read_text())
    for row in result["parameters"]:
        low, high = row["bounds"]
        assert math.isfinite(row["value"]), row
        assert low - 1e-9 <= row["value"] <= high + 1e-9, row
    assert (folder / "out" / "report.html").stat().st_size > 10_000
    return Ended(result["mismatch"]["verdict"])


def main(count: int = 200, first: int = 0) -> int:
    """Status 1 where there was anything but results and lines."""
    verdicts: collections.Counter[str] = collections.Counter()
    seconds = []
    with threadpool_limits(1, "blas"), warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)  # a number that is none has come from somewhere
        for seed in range(first, first + count):
            began = time.process_time()
            with tempfile.TemporaryDirectory() as name:
                try:
                    ended = attempt(Path(name), seed)
                except Exception:  # noqa: BLE001 - the last line and the status tell how many there were
                    ended = Ended("traceback", traceback.format_exc())
            seconds.append(time.process_time() - began)
            verdicts[ended.verdict] += 1
            print(f"cell {seed}: {ended.verdict}, {seconds[-1]:.1f} s{': ' * bool(ended.said)}{ended.said}", flush=True)
    refused, broken = verdicts.pop("refused", 0), verdicts.pop("traceback", 0)
    results = ", ".join(f"{n} {verdict}" for verdict, n in verdicts.most_common())
    spent = f"{np.median(seconds):.1f} s in the median, at most {max(seconds):.0f} s, {sum(seconds):.0f} s in all"
    print(f"{count} cells: {verdicts.total()} results ({results}), {refused} refused in one line, {broken} tracebacks")
    print(f"processor time {spent}; load average {os.getloadavg()[1]:.1f}")
    return int(broken > 0)


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:])))

"""Damages the suite's YAML files at random and loads them: whatever happens must be a value or a CompassError, in time.

python -m test.faults.fuzz_yaml [COUNT] [FIRST_SEED]        default: 100000 inputs from seed 0
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from compass_ros.cells import load
from compass_ros.config import calibration_config, read_yaml
from compass_ros.errors import CompassError
from compass_ros.tracking.config import read_tracker_config

ROOT = Path(__file__).parents[2]
CELLS = sorted((ROOT / "config" / "cells").glob("*.yaml"))
FILES = [*CELLS, ROOT / "config" / "puck_tracker.yaml", ROOT / "config" / "calibrator.yaml"]
SLOWEST_S = 5.0
"""[s] of processor time."""
PIECES = (
    "!!python/object/apply:os.system ['touch owned']", "../../../etc/passwd", "/etc/passwd", "&a [*a]", ".nan", "1e999",
    "-.inf", "null", "{}", "[]", "''", "*a", "<<: *a", "0x7fffffffffffffffffff", "\x00", "\u202e", "- " * 50, "[" * 200,
    "1" * 400, "true", "2026-11-20", "? ", "|", "---", "1" * 5000, "0x" + "f" * 5000, "2026-99-99", "[" * 3000,
    "{a: " * 900, "!!int foo", "!!timestamp foo", "!!binary a", "!!float ''", "x" * 5000, "1:99999999999999:3",
    "{<<: [{a: 1}, {a: 2}]}", "[" + "[a, b], " * 3000 + "]", "\ud800", "0.1e-99999", "-0", "2147483648", "1e308",
)  # fmt: skip


def damaged(text: str, seed: int) -> str:
    """The text with one to three injuries: a value exchanged, a line lost or doubled, indented, or cut off."""
    rng = np.random.default_rng(seed)
    lines = text.splitlines()
    for _ in range(rng.integers(1, 4)):
        at = int(rng.integers(len(lines)))
        piece = PIECES[rng.integers(len(PIECES))]
        key, colon, _ = lines[at].partition(":")
        kind = rng.integers(7)
        if kind < 3 and colon:
            lines[at] = f"{key}: {piece}"
        elif kind == 3:
            lines[at] = lines[at].replace(chr(rng.integers(32, 127)), piece)
        elif kind == 4:
            del lines[at : at + int(rng.integers(1, 4))]
        elif kind == 5:
            lines.insert(at, " " * int(rng.integers(4)) + lines[at])
        else:
            lines = lines[: at + 1]
        lines = lines or [piece]
    return "\n".join(lines)


def loader(file: Path) -> Callable[[Path], object]:
    """What the suite does with such a file."""
    if file in CELLS:
        return lambda path: load(str(path))
    if file.stem == "puck_tracker":
        return read_tracker_config
    return lambda path: calibration_config(read_yaml(path))


def attempt(folder: Path, seed: int) -> str:
    """Load one damaged file in a folder that has the scenes; the complaint, or nothing. Other exceptions are bugs."""
    file = FILES[seed % len(FILES)]
    path = folder / file.name
    path.write_text(damaged(file.read_text(), seed), errors="replace")
    started = time.process_time()
    said = ""
    try:
        loader(file)(path)
    except CompassError as error:
        said = str(error)
    assert "\n" not in said, f"seed {seed}: {said!r}"
    assert len(said) < 2000, f"seed {seed}: {len(said)} letters"
    assert time.process_time() - started < SLOWEST_S, f"seed {seed} took {time.process_time() - started:.1f} s"
    return said


def prepare(folder: Path) -> None:
    """The scenes beside the cells."""
    for scene in (ROOT / "config" / "cells").glob("*.xml"):
        (folder / scene.name).write_text(scene.read_text())


def main(count: int = 100_000, first: int = 0) -> None:
    refused = 0
    with tempfile.TemporaryDirectory() as name:
        prepare(Path(name))
        for seed in range(first, first + count):
            try:
                refused += bool(attempt(Path(name), seed))
            except BaseException:
                print(f"seed {seed}", flush=True)
                raise
    print(f"{count} inputs: {count - refused} loaded, {refused} refused with one line")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))

"""A late camera and a late arm, each planted on the air-hockey table and calibrated with three readings of its bags.

    python scripts/late.py [--cells air_hockey,air_hockey_tool,air_hockey_encoders] [--late-s 0.02] [--shots 12]

The table is the suite's simulator with the paper's "real" parameters; pucks are seen at 60 Hz with 1 mm of noise, the
arm's encoders are read at 240 Hz in steps of 0.01 mm. Prints a line of Markdown for each calibration.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from compass_ros.cells import Cell, load
from compass_ros.config import CalibrationConfig
from compass_ros.pipeline import calibrate
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import Attached, effect
from compass_ros.types import Episode, Floats, Result, Track

START_NS = 1_700_000_000_000_000_000
IMAGES_HZ, READINGS_HZ, NOISE_M, STEP_M = 60.0, 240.0, 1e-3, 1e-5


def shots(cell: Cell, count: int, seed: int) -> Floats:
    """(count, 4) of the paper's action space."""
    low, high = np.array([(a.low, a.high) for a in cell.action]).T
    return np.asarray(np.random.default_rng(seed).uniform(low, high, (count, 4)))


def recorded(law: str, late_s: float, count: int, seed: int) -> list[tuple[Episode, Track]]:
    """Episodes of the pucks, and beside each what the encoders said."""
    cell = load("air_hockey_encoders")
    table = Simulator(cell, [Attached(effect(law), ())])
    inputs = shots(cell, count, seed)
    truth = [*(p.truth for p in cell.spec.parameters), late_s]
    values = np.tile(truth, (count, 1))
    images, readings = (np.arange(-0.3, cell.duration, 1 / rate) for rate in (IMAGES_HZ, READINGS_HZ))
    pucks = table.observe(values, inputs, np.tile(images, (count, 1)))[:, :, :4]
    pucks = pucks + np.random.default_rng(seed).normal(0, NOISE_M, pucks.shape)
    tool = table.observe(values, inputs, np.tile(readings, (count, 1)))[:, :, 4:]
    counted = np.round(tool / STEP_M) * STEP_M
    seen, read = (START_NS + np.round(t * 1e9).astype(np.int64) for t in (images, readings))
    out = []
    for i, shot in enumerate(inputs):
        action = {a.name: float(value) for a, value in zip(cell.action, shot, strict=True)}
        tracks = tuple(Track(f"puck{k + 1}", "xy", seen, pucks[i, :, 2 * k : 2 * k + 2]) for k in range(2))
        own = Track("tool", "joint_position", read, counted[i])
        out.append((Episode(f"shot_{i:02d}", cell.name, "", action, START_NS, tracks), own))
    return out


def read_by(cell: Cell, both: list[tuple[Episode, Track]]) -> list[Episode]:
    """As a reader hands them to a cell: the encoders as its input, as its signal, or not at all."""
    inputs, signals = bool(cell.spec.inputs), bool(cell.spec.signals)
    return [
        Episode(
            e.name, e.cell, e.cell_hash, e.action, e.start_ns, (*e.tracks, *((t,) if signals else ())),
            inputs=(t,) if inputs else (),
        )
        for e, t in both
    ]  # fmt: skip


def line(law: str, name: str, result: Result, seconds: float) -> str:
    """A row of the table."""
    found = []
    for e in result.mismatch.effects:
        sizes = [f"{1e3 * q.value:.1f} ± {1e3 * q.std:.1f} ms" for q in e.parameters.values() if q.unit == "s"]
        found.append(" or ".join([e.name, *e.equivalents]) + " " + ", ".join(sizes))
    return f"| {law} | `{name}` | {result.mismatch.verdict} | {'; '.join(found) or '-'} | {seconds:.0f} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0] if __doc__ else None)
    parser.add_argument("--cells", default="air_hockey,air_hockey_tool,air_hockey_encoders")
    parser.add_argument("--laws", default="camera_latency,actuation_delay")
    parser.add_argument("--late-s", type=float, default=0.02)
    parser.add_argument("--shots", type=int, default=12)
    parser.add_argument("--seed", type=int, default=3)
    given = parser.parse_args()
    for law in given.laws.split(","):
        both = recorded(law, given.late_s, given.shots, given.seed)
        for name in given.cells.split(","):
            cell, began = load(name), time.monotonic()
            result, _ = calibrate(read_by(cell, both), cell, CalibrationConfig(seed=given.seed))
            print(line(law, name, result, time.monotonic() - began), flush=True)


if __name__ == "__main__":
    main()

"""The tables of docs/arms.md: a simulated arm with hidden parameters, and a link whose torque was measured.

python scripts/arms.py simulated --cell kinova3 --seeds 10 [--method mujoco-sysid --rollouts 20000]
python scripts/arms.py torque out/torque_pendulum [--result out/torque]      # bags of `compass import`, a result
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np

from compass_ros.bench.driven import Routine, drawn_truth, record
from compass_ros.calibration.noise import measure_noise
from compass_ros.cells import load
from compass_ros.config import calibration_config
from compass_ros.episodes import read_episodes
from compass_ros.operation.current import sources
from compass_ros.pipeline import calibrate
from compass_ros.posing import launched
from compass_ros.reporting.result_json import read_result
from compass_ros.simulation import Simulator
from compass_ros.simulation.replay import recordings
from compass_ros.simulation.windows import windows

NINETY = 1.645
"""Standard deviations to either side that hold 90 % of a normal distribution."""
AUTHORS = {"J": 0.06259, "mc": 0.1022, "Fv": 0.04707, "Fc": 0.1839 * np.pi / 2, "offset": 0.07586}
"""Of the data's authors, from `pd_identification`: tau = J q'' + m c g sin(q) + Fv q' +
Fc atan(100 q') - offset [SI]."""


def simulated(cell_name: str, seeds: int, method: str, rollouts: int) -> None:
    """A line for each seed: held-out rms beside its floor, intervals, seconds."""
    cell = load(cell_name)
    for seed in range(seeds):
        truth = drawn_truth(cell, seed)
        episodes = record(cell, truth, 10, Routine(), seed)
        began = time.perf_counter()
        settings = {"discover": False, "method": method, "rollouts": rollouts}
        result, _ = calibrate(episodes, cell, calibration_config(settings))
        seconds = time.perf_counter() - began
        gap = {model: result.gap[model]["held_out"].signals["joints"] for model in ("nominal", "calibrated")}
        found, std = (np.array([getattr(row, name) for row in result.parameters]) for name in ("value", "std"))
        inside = float(np.mean(np.abs(found - truth) < NINETY * std))
        alone = float(np.mean([row.identifiable for row in result.parameters]))
        best, floor = gap["calibrated"].rms, gap["calibrated"].floor
        print(
            f"seed {seed}: held out {1e3 * gap['nominal'].rms:.2f} -> {1e3 * best:.3f} mrad, "
            f"{best / floor:.3f} of the floor; "
            f"90 % intervals hold {100 * inside:.0f} %; {100 * alone:.0f} % told alone; {seconds:.0f} s",
            flush=True,
        )


def torque(bags: Path, result: Path) -> None:
    """A line for each run: rms of the angle in windows of 2 s by the default, the authors' and the found parameters."""
    cell = load("torque_pendulum")
    values = {row["name"]: row["value"] for row in read_result(result / "result.json")["parameters"]}
    centre = AUTHORS["mc"]  # the scene's mass is 1 kg
    authors = np.array([-centre, AUTHORS["J"] - centre**2, AUTHORS["Fv"], AUTHORS["Fc"], AUTHORS["offset"]])
    found = np.array([values[p.name] for p in cell.parameters])
    simulator = Simulator(cell)
    for episode in read_episodes([bags], sources(cell), cell.name):
        data = recordings(cell, windows(cell, [episode]))
        noise = measure_noise(data.time_s, data.measured, cell.spec.noise_m, data.stated)
        driven = simulator.driven(data.drives)
        rms = [launched(driven, data, noise, v).gap(v).signals["angle"].rms for v in (driven.defaults, authors, found)]
        said = ", ".join(f"{name} {1e3 * r:.0f}" for name, r in zip(("default", "authors", "ours"), rms, strict=True))
        print(f"{episode.name}: {said} mrad")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parts = parser.add_subparsers(dest="part", required=True)
    one = parts.add_parser("simulated")
    one.add_argument("--cell", default="kinova3")
    one.add_argument("--seeds", type=int, default=10)
    one.add_argument("--method", default="default")
    one.add_argument("--rollouts", type=int, default=0)
    two = parts.add_parser("torque")
    two.add_argument("bags", type=Path)
    two.add_argument("--result", type=Path, default=Path("out/torque"))
    given = parser.parse_args()
    if given.part == "simulated":
        simulated(given.cell, given.seeds, given.method, given.rollouts)
    else:
        torque(given.bags, given.result)


if __name__ == "__main__":
    main()

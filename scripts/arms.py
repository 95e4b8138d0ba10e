"""The tables of docs/arms.md: a simulated arm with hidden parameters, and a link whose torque was measured.

python scripts/arms.py simulated --cell kinova3 --seeds 10 [--method mujoco-sysid --rollouts 20000]
python scripts/arms.py simulated --cell kinova3 --seeds 2 --torque 0.05 [--method inverse-dynamics]
python scripts/arms.py torque out/torque_pendulum [--result out/torque]      # bags of `compass import`, a result
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from compass_ros.bench.driven import Routine, drawn_truth, record
from compass_ros.cells import Cell, load
from compass_ros.cells.registry import dynamics_of
from compass_ros.cells.series import SignalSpec
from compass_ros.config import CalibrationConfig, calibration_config
from compass_ros.episodes import read_episodes
from compass_ros.operation.current import sources
from compass_ros.pipeline import calibrate
from compass_ros.posing import launched, noise_of
from compass_ros.reporting.result_json import read_result
from compass_ros.rivals.inverse_dynamics import Log, as_cell, regress, values
from compass_ros.selection import split
from compass_ros.simulation import Simulator
from compass_ros.simulation.replay import recordings
from compass_ros.simulation.windows import windows
from compass_ros.types import Episode, Floats, SignalGap, Track

REGRESSION = "inverse-dynamics"
FITTED = "pd_identification"
CUTOFFS_HZ = (5.0, 10.0, 20.0)
NINETY = 1.645
"""Standard deviations to either side that hold 90 % of a normal distribution."""
AUTHORS = {"J": 0.06259, "mc": 0.1022, "Fv": 0.04707, "Fc": 0.1839 * np.pi / 2, "offset": 0.07586}
"""Of the data's authors, from `pd_identification`: tau = J q'' + m c g sin(q) + Fv q' +
Fc atan(100 q') - offset [SI]."""


EVERY_HZ = 500.0
"""Targets and joint states where torques are recorded too: sampled once a target, a servo's torque has another mean."""


@dataclass(frozen=True)
class Answer:
    """What a method found."""

    found: Floats
    """(P,) NaN where it says nothing."""
    said: str
    gap: Mapping[str, SignalGap]
    """Of the signal on held-out recordings: `nominal`, `calibrated`."""


def simulated(cell_name: str, seeds: int, method: str, rollouts: int, torque: float, cutoff: float) -> None:
    """A line for each seed: held-out rms beside its floor, errors of parameters, seconds."""
    cell = load(cell_name)
    for seed in range(seeds):
        truth = drawn_truth(cell, seed)
        known = "default" if method == REGRESSION else method
        config = calibration_config({"discover": False, "method": known, "rollouts": rollouts})
        if torque:
            episodes = record(with_torques(cell, torque), truth, 10, Routine(rate_hz=EVERY_HZ), seed)
        else:
            episodes = record(cell, truth, 10, Routine(), seed)
        began, used = time.perf_counter(), time.process_time()
        answer = (
            regression(cell, episodes, config, cutoff)
            if method == REGRESSION
            else ours(cell, [replace(e, tracks=e.tracks[:1]) for e in episodes], config, truth)
        )
        seconds, used = time.perf_counter() - began, time.process_time() - used
        nominal, best = answer.gap["nominal"], answer.gap["calibrated"]
        print(
            f"seed {seed}: held out {1e3 * nominal.rms:.2f} -> {1e3 * best.rms:.3f} mrad, "
            f"{best.rms / best.floor:.3f} of the floor; {answer.said}; "
            f"errors in half widths: {errors(cell, truth, answer.found)}; "
            f"{seconds:.0f} s, {used:.0f} s of processor time",
            flush=True,
        )


def ours(cell: Cell, episodes: list[Episode], config: CalibrationConfig, truth: Floats) -> Answer:
    """A method of `compass calibrate`."""
    result, _ = calibrate(episodes, cell, config)
    found, std = (np.array([getattr(row, name) for row in result.parameters]) for name in ("value", "std"))
    inside = float(np.mean(np.abs(found - truth) < NINETY * std))
    alone = float(np.mean([row.identifiable for row in result.parameters]))
    gap = {model: result.gap[model]["held_out"].signals["joints"] for model in ("nominal", "calibrated")}
    return Answer(found, f"90 % intervals hold {100 * inside:.0f} %; {100 * alone:.0f} % told alone", gap)


def with_torques(cell: Cell, noise: float) -> Cell:
    """The cell with the torques of its drives measured beside its joints [N m]."""
    of = cell.spec.inputs[0].of
    torques = SignalSpec(name="torques", quantity="joint_effort", of=of, noise=noise, step=None, fitted=False)
    return Cell(replace(cell.spec, signals=(*cell.spec.signals, torques)), cell.path, f"{cell.hash}/torques")


def regression(cell: Cell, episodes: list[Episode], config: CalibrationConfig, cutoff: float) -> Answer:
    """Classic regression on the recordings that `compass calibrate` would fit, judged on those that it would hold out.

    Recordings with positions, torques and targets.
    """
    fit, held_out = split(episodes, config)
    joints = cell.spec.inputs[0].targets
    logs = [
        Log(_seconds(e, e.tracks[0]), e.tracks[0].value, e.tracks[1].value, e.inputs[0].value)
        for e in fit
    ]  # fmt: skip
    found = regress(dynamics_of(cell).model, joints, logs, cutoff)
    said = values(cell, found, joints)
    seen = [replace(e, tracks=e.tracks[:1]) for e in held_out]
    with TemporaryDirectory() as folder:
        regressed = as_cell(cell, found, joints, Path(folder))
        gap = {
            "nominal": judged(cell, seen)["joints"],
            "calibrated": judged(regressed, seen)["joints"],
        }
    numbers = np.array([said.get(p.name, np.nan) for p in cell.parameters])
    return Answer(numbers, f"{found.told} numbers told", gap)


def judged(cell: Cell, episodes: list[Episode], values: Floats | None = None) -> Mapping[str, SignalGap]:
    """How far the cell is from recordings at (P,) values, or at its defaults; each window begins where it fits best."""
    data = recordings(cell, windows(cell, episodes))
    noise = noise_of(cell, data)
    driven = Simulator(cell).driven(data.drives)
    chosen = driven.defaults if values is None else values
    return launched(driven, data, noise, chosen).gap(chosen, noise.rms).signals


def errors(cell: Cell, truth: Floats, found: Floats) -> str:
    """Root mean square error in half widths by kind of parameter."""
    missed = (found - truth) / [p.half_width for p in cell.parameters]
    kinds: dict[str, list[float]] = {}
    for parameter, one in zip(cell.parameters, missed.tolist(), strict=True):
        kinds.setdefault(parameter.name.rpartition("@")[2].partition("_")[0], []).append(one)
    return ", ".join(f"{kind} {np.sqrt(np.mean(np.square(own))):.2f}" for kind, own in kinds.items())


def _seconds(episode: Episode, track: Track) -> Floats:
    return np.asarray((track.stamp_ns - episode.start_ns) * 1e-9)


def torque(bags: Path, result: Path) -> None:
    """A line for each run: rms of the angle in windows of 2 s by the default, the authors' and the found parameters."""
    cell = load("torque_pendulum")
    values = {row["name"]: row["value"] for row in read_result(result / "result.json")["parameters"]}
    centre = AUTHORS["mc"]  # the scene's mass is 1 kg
    authors = np.array([-centre, AUTHORS["J"] - centre**2, AUTHORS["Fv"], AUTHORS["Fc"], AUTHORS["offset"]])
    found = np.array([values[p.name] for p in cell.parameters])
    episodes = read_episodes([bags], sources(cell), cell.name)
    fitted = next(e for e in episodes if e.name == FITTED)
    angle, driving = fitted.track("angle"), fitted.inputs[0]
    pulled = np.interp(_seconds(fitted, angle), _seconds(fitted, driving), driving.value[:, 0])
    log = Log(_seconds(fitted, angle), angle.value, pulled[:, None])
    with TemporaryDirectory() as folder:
        cells = {"default": (cell, None), "authors": (cell, authors), "ours": (cell, found)}
        for cutoff in CUTOFFS_HZ:
            regressed = regress(dynamics_of(cell).model, ("axis",), [log], cutoff)
            own = Path(folder) / f"{cutoff:g}"
            own.mkdir()
            cells[f"regression at {cutoff:g} Hz"] = (as_cell(cell, regressed, ("axis",), own), None)
            second = regressed.second[0]
            numbers = {
                "inertia": second[0, 0] + second[2, 2] + regressed.armature[0],
                "m c": -second[2, 3],
                "viscous": regressed.viscous[0],
                "Coulomb": regressed.coulomb[0],
                "offset": -regressed.offset[0],
            }
            print(f"regression at {cutoff:g} Hz [SI]:", ", ".join(f"{name} {n:.3f}" for name, n in numbers.items()))
        for episode in episodes:
            rms = {name: judged(one, [episode], at)["angle"].rms for name, (one, at) in cells.items()}
            print(f"{episode.name}: {', '.join(f'{name} {1e3 * r:.0f}' for name, r in rms.items())} mrad", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parts = parser.add_subparsers(dest="part", required=True)
    one = parts.add_parser("simulated")
    one.add_argument("--cell", default="kinova3")
    one.add_argument("--seeds", type=int, default=10)
    one.add_argument("--method", default="default")
    one.add_argument("--rollouts", type=int, default=0)
    one.add_argument("--torque", type=float, default=0.0, help="noise of measured torques [N m]; 0: none is measured")
    one.add_argument("--cutoff", type=float, default=5.0, help="of the regression's filter [Hz]")
    two = parts.add_parser("torque")
    two.add_argument("bags", type=Path)
    two.add_argument("--result", type=Path, default=Path("out/torque"))
    given = parser.parse_args()
    if given.part == "simulated":
        if given.method == REGRESSION and not given.torque:
            parser.error("a regression needs --torque")
        simulated(given.cell, given.seeds, given.method, given.rollouts, given.torque, given.cutoff)
    else:
        torque(given.bags, given.result)


if __name__ == "__main__":
    main()

"""Does evidence survive on a GPU, and what would be gained: MJX with our laws beside `mujoco.rollout` (docs/gpu.md).

    python benchmarks/gpu.py --out OUT.jsonl [--seconds 345] [--small]

Needs jax and mujoco-mjx beside the core. Two cases: the smooth air-hockey table with its friction and an outward push,
and `kinova3` with a torque that repeats with the angle. For each and each precision: rms difference from MuJoCo in
units of the noise, Jacobians, log evidence for the law and verdicts over draws of the noise, rollouts a second by
batch, and what a whole discovery would take. Lines of JSON as they come, the most important first; it ends within
`--seconds`.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections import defaultdict
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from operator import attrgetter
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from mujoco.rollout import Rollout

from compass_ros.bench.driven import Routine, drawn_truth, record
from compass_ros.calibration.differences import FIRST_STEP, Linear, difference_steps
from compass_ros.cells import load
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import EFFECTS, Attached
from compass_ros.simulation.replay import recordings
from compass_ros.simulation.visited import Visited
from compass_ros.simulation.windows import windows
from compass_ros.targets.mjx import placed
from compass_ros.types import Floats, Ints

Line = dict[str, Any]
HERE = Path(__file__).parent
ALPHA = 0.01
"""False-alarm rate of a verdict: a law is named at posterior odds of (1 - ALPHA) / ALPHA."""
NAMED = float(np.log((1 - ALPHA) / ALPHA))
NONE = np.empty(0)
"""What the steps of differences do not ask for."""
DISPLACED = 0.3
"""How far off the second point of the parameters is, in standard deviations of the prior."""
STRENGTHS = (0.0, 0.7, 1.0, 1.3, 2.0)
"""Of the planted law, in those at which it is just named on average."""
PUSH = (0.0, -0.1, 0.03, 0.12, 0.5)
"""Strength, centre, radius and tail of the outward push: where the shots of the paper pass."""
TABLE = (
    *("pusher@dyna@damping", "puck1@dyna@damping", "puck2@dyna@damping", "left_wall@dyna@damping"),
    *("right_wall@dyna@damping", "obstacle@dyna@damping", "puck1@dyna@friction_sliding", "puck2@dyna@friction_sliding"),
    *("puck1@dyna@mass", "puck2@dyna@mass", "pusher@actuation@vel_discount", "pusher@actuation@servo_gain"),
    *("env@camera@bias_x", "env@camera@bias_y"),
)
"""Parameters of the table that differ in its worlds, and some that a caliper gives."""


@dataclass(frozen=True)
class Case:
    """A simulator with one law, E episodes, the truth, and which numbers a fit would move."""

    name: str
    simulator: Simulator
    truth: Floats
    """(P,) the law absent."""
    inputs: Floats
    free: Ints
    """(p,) which parameters; the last is the law's amplitude."""
    prior_std: Floats
    """(p,)"""
    sigma: Floats
    """(C,) noise of each column."""
    every: int
    frames: int

    @property
    def steps(self) -> int:
        return self.every * self.frames


def table(episodes: int, frames: int, free: int) -> Case:
    """Shots from the paper's box; 50 frames a second."""
    law = Attached(EFFECTS["fan_field"], ("puck1", "puck2"))
    simulator = Simulator(load("air_hockey"), effects=[law])
    cell = simulator.cell
    low, high = np.array([(a.low, a.high) for a in cell.action]).T
    shots = np.random.default_rng(0).uniform(low, high, (episodes, len(low)))
    truth = np.concatenate([drawn_truth(cell, 0), PUSH])
    names = [p.name for p in simulator.parameters]
    chosen = [names.index(name) for name in TABLE[:free]] + [len(cell.parameters)]
    sigma = np.full(4, cell.spec.noise_m)
    return _case("air_hockey", simulator, truth, simulator.inputs(shots), chosen, sigma, 20, frames)


def arm(recorded: int, frames: int, free: int) -> Case:
    """Windows of virtual recordings, with all 64 parameters; 50 frames a second."""
    cell = load("kinova3")
    truth = drawn_truth(cell, 0)
    data = recordings(cell, windows(cell, record(cell, truth, recorded, Routine(), 0)))
    plain = Simulator(cell).driven(data.drives)
    inputs = plain.inputs(data.inputs)
    size = Visited(plain, truth, inputs, data.time_s).joint_sizes()["joint_2"]
    law = Attached(EFFECTS["cogging"].at(size), ("joint_2",))
    simulator = plain.with_effects([law])
    shape = [q.start for q in law.effect.quantities]
    chosen = [*range(min(free, len(truth))), len(truth)]
    sigma = np.array([s.noise or 0.0 for s in cell.signals for _ in range(s.size)])
    rounded = np.array([s.step or 0.0 for s in cell.signals for _ in range(s.size)]) / np.sqrt(12)
    sigma = np.hypot(sigma, rounded)
    return _case("kinova3", simulator, np.concatenate([truth, shape]), inputs, chosen, sigma, 10, frames)


def _case(
    name: str,
    simulator: Simulator,
    truth: Floats,
    inputs: Floats,
    free: list[int],
    sigma: Floats,
    every: int,
    frames: int,
) -> Case:
    laws = [q.scale for a in simulator.effects for q in a.effect.quantities]
    wide = np.array([*(p.half_width for p in simulator.cell.parameters), *laws])
    return Case(name, simulator, truth, inputs, np.array(free), wide[free], sigma, every, frames)


# --- rollouts ---------------------------------------------------------------------------------------------------------


def prepared(case: Case, values: Floats) -> tuple[Floats, Floats, Floats | None]:
    """(R E, P) values, starts and controls: every row of (R, P) values with every episode."""
    rows = np.repeat(values, len(case.inputs), axis=0)
    inputs = np.tile(case.inputs, (len(values), 1))
    physics = case.simulator.physics
    return rows, physics.start(rows, inputs), physics.controls(rows, inputs, case.steps)


def observed(case: Case, values: Floats, places: Floats) -> Floats:
    """(R, E, F, C) what sensors say of (R E, F, C) places."""
    rows = np.repeat(values, len(case.inputs), axis=0)
    physics = case.simulator.physics
    seen = physics.dynamics.observe(physics.of_cell(rows), places)
    return np.asarray(seen.reshape(len(values), len(case.inputs), *seen.shape[1:]))


def by_mujoco(case: Case, values: Floats) -> Floats:
    """(R, E, F, C) by the suite's own simulator."""
    rows, start, controls = prepared(case, values)
    columns, out = 1 + case.simulator.physics.dynamics.columns(), []
    for i in range(0, len(rows), 128):
        told = None if controls is None else controls[i : i + 128]
        states = case.simulator.play(rows[i : i + 128], start[i : i + 128], told, case.steps)[0]
        out.append(states[:, case.every - 1 :: case.every, columns])
    return observed(case, values, np.concatenate(out))


def write(case: Case, values: Floats, folder: Path) -> list[str]:
    """The scene and (R, P) rows of values as arrays for `gpu_worker.py`; names of what the rows change in the model."""
    physics, model = case.simulator.physics, case.simulator.physics.model
    spec_path = case.simulator.cell.model_path
    (folder / f"{case.name}.xml").write_text(Path(spec_path).read_text(encoding="utf-8"), encoding="utf-8")
    names = [n for n in dir(model) if n[0] != "_" and _is_real(model, n)] + ["opt.gravity"]
    arrays: dict[str, list[Floats]] = {name: [] for name in names}
    for row in values:
        written = case.simulator.written(row)
        for name in names:
            arrays[name].append(np.array(attrgetter(name)(written)))
    compiled = mujoco.MjModel.from_xml_path(str(folder / f"{case.name}.xml"))
    own = {name: np.stack(rows) for name, rows in arrays.items()}
    differing = {name: rows for name, rows in own.items() if (rows != attrgetter(name)(compiled)).any()}
    terms = physics.terms(values)
    wide = max(term.numbers.shape[1] for term in terms)
    numbers = np.zeros((len(values), len(terms), wide))
    for i, term in enumerate(terms):
        numbers[:, i, : term.numbers.shape[1]] = term.numbers
    _, start, controls = prepared(case, values)
    told, of = _unique(np.zeros((len(start), case.steps, 0)) if controls is None else controls)
    nq, nv = model.nq, model.nv
    np.savez(
        folder / f"{case.name}.npz",
        row=np.repeat(np.arange(len(values)), len(case.inputs)),
        qpos=start[:, 1 : 1 + nq],
        qvel=start[:, 1 + nq : 1 + nq + nv],
        controls=told,
        control=of,
        numbers=numbers,
        kinds=json.dumps([placed(term) for term in terms]),
        columns=physics.dynamics.columns(),
        every=case.every,
        frames=case.frames,
        **{f"field_{name}": value for name, value in differing.items()},
    )
    return sorted(differing)


def _is_real(model: mujoco.MjModel, name: str) -> bool:
    value = getattr(model, name)
    return isinstance(value, np.ndarray) and value.dtype == np.float64


def _unique(controls: Floats) -> tuple[Floats, Ints]:
    """Different controls, and which of them each rollout has."""
    known: dict[bytes, int] = {}
    of = np.array([known.setdefault(own.tobytes(), len(known)) for own in controls])
    return np.stack([controls[int(np.argmax(of == i))] for i in range(len(known))]), of


# --- evidence ---------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Rows:
    """Which rows of values are what."""

    values: Floats
    strengths: Floats
    steps: Floats
    """(p,) of the differences, in standard deviations of the prior."""

    def jacobian(self, seen: Floats, sigma: Floats) -> Floats:
        """(N, p) in sigmas for a standard deviation of the prior, of (R, E, F, C)."""
        first = 2 + len(self.strengths)
        up, down = seen[first::2], seen[first + 1 :: 2]
        slopes = (up - down) / (2 * self.steps[:, None, None, None]) / sigma
        return np.asarray(slopes.reshape(len(self.steps), -1).T)


def differences(case: Case, steps: Floats) -> Floats:
    """(2 p, P) values up and down by steps in standard deviations of the prior."""
    out = np.tile(case.truth, (2 * len(steps), 1))
    for i, (free, step) in enumerate(zip(case.free, steps * case.prior_std, strict=True)):
        out[2 * i, free] += step
        out[2 * i + 1, free] -= step
    return out


def rows_of(case: Case) -> Rows:
    """Truth, displaced, planted strengths, differences: by Jacobians of MuJoCo."""
    steps = np.full(len(case.free), FIRST_STEP)
    jacobian = np.empty(0)
    for _ in range(2):
        some = Rows(differences(case, steps), np.empty(0), steps)
        seen = by_mujoco(case, np.concatenate([np.tile(case.truth, (2, 1)), some.values]))
        jacobian = some.jacobian(seen, case.sigma)
        shaped = jacobian.reshape(len(case.inputs), -1, len(steps))
        steps = difference_steps(Linear(NONE, shaped[:, :, None], NONE, NONE))
    strengths = np.array(STRENGTHS) * just_named(jacobian)
    planted = np.tile(case.truth, (len(strengths), 1))
    planted[:, case.free[-1]] += strengths * case.prior_std[-1]
    away = case.truth.copy()
    signs = np.random.default_rng(1).choice([-1.0, 1.0], len(case.free) - 1)
    away[case.free[:-1]] += DISPLACED * signs * case.prior_std[:-1]
    values = np.concatenate([case.truth[None], away[None], planted, differences(case, some.steps)])
    return Rows(values, strengths, some.steps)


def just_named(jacobian: Floats) -> float:
    """Amplitude of the law, in standard deviations of its prior, at which the expected log odds are NAMED."""
    gram = jacobian.T @ jacobian
    within = np.linalg.inv(np.eye(len(gram)) + gram)[-1, -1]
    known = 1 / within - 1  # what the data say of the amplitude beside the others
    square = (2 * NAMED + np.log1p(known)) * (1 + known) / known
    return float(np.sqrt(max(square - 1, 0) / known))


def log_odds(jacobian: Floats, residual: Floats) -> Floats:
    """(n,) log evidence with the law less that without, for (N, n) residuals in sigmas: exact for a linear model."""
    gram, along = jacobian.T @ jacobian, jacobian.T @ residual

    def of(count: int) -> Floats:
        part = np.eye(count) + gram[:count, :count]
        gained = np.sum(along[:count] * np.linalg.solve(part, along[:count]), axis=0)
        return np.asarray(0.5 * gained - 0.5 * np.linalg.slogdet(part)[1])

    return of(len(gram)) - of(len(gram) - 1)


@dataclass(frozen=True)
class Drawn:
    """Recordings with noise, the same for all who are compared: (S, D, N) of strengths and draws, in sigmas."""

    data: Floats

    @staticmethod
    def of(case: Case, rows: Rows, seen: Floats, draws: int) -> Drawn:
        rng = np.random.default_rng(2)
        planted = seen[2 : 2 + len(rows.strengths)] / case.sigma
        flat = planted.reshape(len(rows.strengths), 1, -1)
        return Drawn(flat + rng.normal(size=(len(rows.strengths), draws, flat.shape[-1])))


def judged(case: Case, rows: Rows, seen: Floats, drawn: Drawn) -> tuple[Floats, Floats]:
    """(S, D) log odds, (2,) mean chi square of the first strength's data at the truth and at the displaced point."""
    jacobian = rows.jacobian(seen, case.sigma)
    base = (seen[0] / case.sigma).ravel()
    odds = np.stack([log_odds(jacobian, (own - base).T) for own in drawn.data])
    away = (seen[1] / case.sigma).ravel()
    chi = [np.mean(np.sum((drawn.data[0] - point) ** 2, axis=1)) for point in (base, away)]
    return odds, np.array(chi)


def compared(case: Case, rows: Rows, ours: Floats, theirs: Floats, draws: int) -> dict[str, Any]:
    """What a backend's (R, E, F, C) differ in, where it has counted all frames; else of those that it has."""
    frames = theirs.shape[2]
    ours = ours[:, :, :frames]
    apart = (theirs - ours) / case.sigma
    rms = np.sqrt(np.mean(apart[:1] ** 2, axis=(0, 2, 3)))  # (E,) at the truth
    drawn = Drawn.of(case, rows, ours, draws)
    odds, chi = judged(case, rows, ours, drawn)
    odds_b, chi_b = judged(case, rows, theirs, drawn)
    jacobian, jacobian_b = rows.jacobian(ours, case.sigma), rows.jacobian(theirs, case.sigma)
    size = np.linalg.norm(jacobian, axis=0)
    wrong = np.linalg.norm(jacobian_b - jacobian, axis=0) / np.where(size > 0, size, 1)
    same = (odds > NAMED) == (odds_b > NAMED)
    return {
        "frames": frames,
        "numbers": int(drawn.data.shape[-1]),
        "rms_sigma": float(np.sqrt(np.mean(apart[0] ** 2))),
        "rms_sigma_median_episode": float(np.median(rms)),
        "rms_sigma_worst_episode": float(rms.max()),
        "largest_sigma": float(np.abs(apart[0]).max()),
        "rms_sigma_all_rows": float(np.sqrt(np.mean(apart**2))),
        "chi2": chi.tolist(),
        "chi2_off": (chi_b - chi).tolist(),
        "jacobian_off_median": float(np.median(wrong[size > 0])),
        "jacobian_off_worst": float(wrong[size > 0].max()),
        "jacobian_off_law": float(wrong[-1]),
        "log_odds": odds.mean(axis=1).tolist(),
        "log_odds_off_mean": (odds_b - odds).mean(axis=1).tolist(),
        "log_odds_off_largest": float(np.abs(odds_b - odds).max()),
        "named": (odds > NAMED).mean(axis=1).tolist(),
        "agree": same.mean(axis=1).tolist(),
        "agree_all": float(same.mean()),
        "verdicts": int(same.size),
    }


# --- rates ------------------------------------------------------------------------------------------------------------


def cpu_rates(case: Case, rows: Rows, sizes: list[int]) -> list[dict[str, Any]]:
    """Rollouts a second on all cores: `mujoco.rollout` with one model and no law, and ours with both."""
    values, start, controls = prepared(case, rows.values)
    model, parts = case.simulator.physics.model, case.simulator.physics.drives.parts
    data = [mujoco.MjData(model) for _ in range(case.simulator.threads)]
    pool, out = Rollout(nthread=case.simulator.threads), []
    for size in sizes:
        which = np.arange(size) % len(values)
        mujoco.set_mjcb_time(None)
        began = time.perf_counter()
        for i in range(0, size, 512):
            part = which[i : i + 512]
            told = None if controls is None else controls[part]
            pool.rollout(model, data, start[part], told, control_spec=parts, nstep=case.steps)
        bare = time.perf_counter() - began
        began = time.perf_counter()
        for i in range(0, size, 512):
            part = which[i : i + 512]
            case.simulator.play(values[part], start[part], None if controls is None else controls[part], case.steps)
        ours = time.perf_counter() - began
        out.append({"batch": size, "rollouts_s": size / bare, "with_laws_rollouts_s": size / ours})
    return out


def discovery(counts: dict[str, Any], gpu_step_s: dict[int, float], cpu_step_s: float, cores: int) -> dict[str, float]:
    """Seconds of a whole run by its counts of batches: what is no rollout, rollouts on all cores, on the GPU.

    `gpu_step_s`: seconds of a step of a batch, by size; between sizes a line in the logarithms. `cpu_step_s`: of one
    rollout's step on one core; batches smaller than the number of cores leave some idle.
    """
    sizes = np.array(sorted(gpu_step_s))
    seconds = np.array([gpu_step_s[size] for size in sizes.tolist()])
    on_gpu = on_cpu = 0.0
    for one in counts["batches"]:
        rollouts, steps = one["rollouts"], one["steps"] * one["count"]
        at = np.interp(np.log(max(rollouts, 1)), np.log(sizes), np.log(seconds))
        on_gpu += float(np.exp(at)) * steps
        on_cpu += -(-rollouts // cores) * cpu_step_s * steps
    rest = counts["whole_s"] - counts["rollouts_s"]
    return {
        "rest_s": rest,
        "rollouts_one_core_s": counts["rollouts_s"],
        "rollouts_all_cores_s": on_cpu,
        "rollouts_gpu_s": on_gpu,
        "whole_all_cores_s": rest + on_cpu,
        "whole_gpu_s": rest + on_gpu,
        "most_gain": (rest + on_cpu) / rest,
    }


# --- the whole --------------------------------------------------------------------------------------------------------


Kept = tuple[Case, Rows, Floats]
"""A case, its rows, and what MuJoCo says of them."""


class Log:
    """Lines of JSON, on the screen and in a file, as they come."""

    def __init__(self, path: Path) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        self._file, self._began = path.open("w", encoding="utf-8"), time.monotonic()

    def say(self, **row: object) -> None:
        line = json.dumps({"at_s": round(time.monotonic() - self._began, 1), **row})
        print(line, flush=True)
        self._file.write(line + "\n")
        self._file.flush()


class Run:
    """One precision, in a process of its own; its lines are read in a thread, and results are compared as they come."""

    def __init__(
        self,
        folder: Path,
        label: str,
        seconds: float,
        sizes: list[int],
        then: Callable[[Line], None],
        more: Mapping[str, str],
    ) -> None:
        words = [sys.executable, str(HERE / "gpu_worker.py"), str(folder), label, str(seconds), *map(str, sizes)]
        environment = {**os.environ, "XLA_PYTHON_CLIENT_MEM_FRACTION": "0.25", **PRECISIONS[label], **more}
        self.label, self._then, self._stop = label, then, time.monotonic() + seconds + 20
        self._running = subprocess.Popen(words, stdout=subprocess.PIPE, text=True, env=environment)
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        for line in self._running.stdout or ():
            if line.startswith("{"):
                self._then(json.loads(line))

    def end(self) -> int:
        """Wait for it, a little beyond its time; its exit status."""
        try:
            self._running.wait(max(self._stop - time.monotonic(), 0.1))
        except subprocess.TimeoutExpired:
            self._running.kill()
        self._reader.join(30)
        return self._running.wait()


ON_CPU = {"JAX_PLATFORMS": "cpu", "XLA_FLAGS": "--xla_disable_hlo_passes=fusion"}
"""On a processor XLA fuses the chain of an arm so that each link computes those before it anew: twenty times slower."""
LEFT_ALONE = "float32_as_jax_leaves_it"
PRECISIONS: dict[str, dict[str, str]] = {
    "float32": {"JAX_ENABLE_X64": "0", "JAX_DEFAULT_MATMUL_PRECISION": "highest"},
    "float64": {"JAX_ENABLE_X64": "1"},
    LEFT_ALONE: {"JAX_ENABLE_X64": "0"},
}
"""Matrix products of float32 on tensor cores keep ten bits of the fraction unless they are told otherwise."""


class Results:
    """What comes of the workers, compared and said."""

    def __init__(
        self, log: Log, folder: Path, kept: Mapping[str, Kept], cpu_step_s: Mapping[str, float], draws: int
    ) -> None:
        self._log, self._folder, self._kept, self._draws = log, folder, kept, draws
        self._cpu_step_s, self._steps = cpu_step_s, defaultdict[tuple[str, str], dict[int, float]](dict)
        self._lock = threading.Lock()

    def take(self, line: Line) -> None:
        with self._lock:
            self._log.say(what="mjx", **line)
            if "step_ms" in line:
                self._steps[line["label"], line["case"]][line["batch"]] = line["step_ms"] / 1e3
            if line.get("compared"):
                case, rows, seen = self._kept[line["case"]]
                with np.load(self._folder / f"{line['label']}-{case.name}.npz") as file:
                    theirs = observed(case, rows.values, np.asarray(file["seen"], float))
                found = compared(case, rows, seen, theirs, self._draws)
                self._log.say(what="accuracy", label=line["label"], case=case.name, **found)

    def discoveries(self) -> None:
        """What whole runs would take at the rates that were measured."""
        for (label, name), steps in self._steps.items():
            path, cores = HERE / "results" / f"gpu_counts_{name}.json", self._kept[name][0].simulator.threads
            counts = json.loads(path.read_text(encoding="utf-8"))
            whole = discovery(counts, steps, self._cpu_step_s[name], cores)
            self._log.say(what="discovery", label=label, case=name, cores=cores, batches=sorted(steps), **whole)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="lines of JSON")
    parser.add_argument("--seconds", type=float, default=345, help="after which nothing new is begun")
    parser.add_argument("--case", choices=("air_hockey", "kinova3"), help="this one alone")
    parser.add_argument("--precision", choices=tuple(PRECISIONS), help="this one alone")
    parser.add_argument(
        "--small", action="store_true", help="short windows, few parameters: whether the script runs, on the processor"
    )
    given = parser.parse_args()
    began, log = time.monotonic(), Log(given.out)

    def left() -> float:
        return float(given.seconds) - (time.monotonic() - began)

    small = given.small
    made: dict[str, Callable[[], Case]] = {
        "air_hockey": lambda: table(*((2, 5, 2) if small else (22, 125, 14))),
        "kinova3": lambda: arm(*((1, 5, 2) if small else (3, 250, 64))),
    }
    cases = [make() for name, make in made.items() if given.case in (None, name)]
    if small:
        cases = [replace(case, inputs=case.inputs[:2]) for case in cases]
    sizes, draws = (list[int](), 10) if small else ([4096, 64, 16384], 100)
    log.say(what="machine", cores=cases[0].simulator.threads, numpy=np.__version__, mujoco=mujoco.__version__)
    kept: dict[str, Kept] = {}
    cpu_step_s: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for case in cases:
            rows = rows_of(case)
            seen = by_mujoco(case, rows.values)
            kept[case.name] = (case, rows, seen)
            changed = write(case, rows.values, folder)
            odds, _ = judged(case, rows, seen, Drawn.of(case, rows, seen, draws))
            log.say(
                what="case",
                case=case.name,
                rollouts=len(rows.values) * len(case.inputs),
                steps=case.steps,
                parameters=len(case.free),
                changed=changed,
                strengths=rows.strengths.tolist(),
                sigma=case.sigma.tolist(),
                log_odds=odds.mean(axis=1).tolist(),
                named=(odds > NAMED).mean(axis=1).tolist(),
            )
            for row in cpu_rates(case, rows, [8] if small else [64, 1024, 4096]):
                log.say(what="cpu", case=case.name, **row)
                cpu_step_s[case.name] = case.simulator.threads / (row["with_laws_rollouts_s"] * case.steps)
        more = ON_CPU if small else {}
        results = Results(log, folder, kept, cpu_step_s, draws)
        runs = [
            Run(folder, label, left() - 20, [] if label == LEFT_ALONE else sizes, results.take, more)
            for label in PRECISIONS
            if given.precision in (None, label)
        ]
        for run in runs:
            if status := run.end():
                log.say(what="failed", label=run.label, status=status)
        results.discoveries()
    log.say(what="done")


if __name__ == "__main__":
    main()

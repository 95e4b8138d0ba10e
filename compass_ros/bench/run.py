"""Run the cases of a benchmark one after the other and write each result down at once."""

from __future__ import annotations

import datetime
import json
import math
import platform
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from compass_ros.bench.case import Case
from compass_ros.bench.edges import total_effects
from compass_ros.bench.outcome import append, case_of, outcome, read
from compass_ros.bench.world import World, build
from compass_ros.calibration.methods import compass_config, method
from compass_ros.cells import load
from compass_ros.executors import Executor
from compass_ros.reporting.atomic import write_text
from compass_ros.types import Estimate, Floats, Progress, Report, silent

RESULTS = "results.jsonl"
_PACKAGES = ("compass_ros", "mujoco", "numpy", "scipy", "torch", "sbi", "cma")


def run_bench(
    cases: Sequence[Case], out: Path, report: Report = silent, threads: int = 0, executor: Executor | None = None
) -> int:
    """Run what `out/results.jsonl` does not have yet; returns how many cases ran.

    Interrupted runs go on where they were. `report` gets the share of the whole, the case as the stage, and its
    method's gap; when it asks for a stop, the running case is dropped and nothing of it is written. With an executor
    it hears of whole cases alone, and those that run when it asks for a stop are dropped.
    """
    for case in cases:
        method(case.method)  # a wrong name ends before the first hour, not after it
    out.mkdir(parents=True, exist_ok=True)
    path = out / RESULTS
    done = {case_of(row).key for row in read(path)}
    waiting = [case for case in cases if case.key not in done]
    if executor is not None:
        return _run_many(waiting, out, report, threads, executor)
    for i, case in enumerate(waiting):
        share = (len(cases) - len(waiting) + i) / len(cases)
        watcher = _Watcher(case, share, 1 / len(cases), report)
        row = row_of(out, threads, case, watcher)
        if watcher.stopped:
            return i
        append(path, row)
    report(Progress("bench", len(cases), 1.0, math.nan, math.nan))
    return len(waiting)


def _run_many(waiting: Sequence[Case], out: Path, report: Report, threads: int, executor: Executor) -> int:
    """Several at a time; the file has a line more after each."""
    for done, (i, row) in enumerate(executor.each(partial(row_of, out, threads), waiting), 1):
        append(out / RESULTS, row)
        if not report(Progress(_title(waiting[i]), done, done / len(waiting), math.nan, math.nan)):
            return done
    return len(waiting)


def row_of(out: Path, threads: int, case: Case, report: Report = silent) -> dict[str, Any]:
    """A case's line of the results. `out` keeps the total effects of its task, on the machine that runs it."""
    world = build(case, threads)
    began = perf_counter()
    estimate = run_case(case, world, report)
    wall = perf_counter() - began
    effects = _effects(case, out, threads) if estimate.graph is not None else None
    return outcome(case, world, estimate, effects, wall) | {
        "time": datetime.datetime.now(datetime.timezone.utc).isoformat(timespec="seconds"),
        "versions": versions(),
    }


def _title(case: Case) -> str:
    return f"{case.task} {case.method} seed {case.seed} {case.setting()}".strip()


def run_case(case: Case, world: World, report: Report = silent) -> Estimate:
    """The case's method on the case's world."""
    if case.method == "compass" and case.sparse_weight is not None:
        from compass_ros.calibration.compass import compass

        config = replace(compass_config(case.allowance), sparse_weight=case.sparse_weight)
        p = world.problem
        return compass(p.differences, p.actions, p.parameters, p.factors, p.start, config, case.seed, report)
    return method(case.method).run(world.problem, case.allowance, case.seed, report)


class _Watcher:
    """Scales a case's progress to the whole run and remembers a wish to stop."""

    def __init__(self, case: Case, base: float, share: float, report: Report) -> None:
        self.title = _title(case)
        self.base, self.share, self.report = base, share, report
        self.stopped = False

    def __call__(self, progress: Progress) -> bool:
        whole = replace(progress, stage=self.title, done=self.base + self.share * progress.done)
        self.stopped = self.stopped or not self.report(whole)
        return not self.stopped


def _effects(case: Case, out: Path, threads: int) -> Floats:
    """Total effects of the task around its defaults, measured once and kept beside the results."""
    reference = Case(case.task, "compass", 0, parameters=case.parameters)
    which = "" if case.parameters == "cell" else f"-{case.parameters}"
    path = out / f"effects-{Path(case.task).stem}{which}.json"
    cell = load(case.task, case.parameters)
    names = [p.name for p in cell.parameters]
    if path.exists():
        kept = json.loads(path.read_text(encoding="utf-8"))
        if kept["cell_hash"] == cell.hash and kept["parameters"] == names:
            return np.array(kept["total_effects"])
    effects = total_effects(build(reference, threads).problem)
    content = {"cell_hash": cell.hash, "parameters": names, "total_effects": np.round(effects, 6).tolist()}
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, json.dumps(content))
    return np.round(effects, 6)


def versions() -> dict[str, str]:
    """What the numbers depend on; packages that are not installed are left out."""
    found = {"python": platform.python_version(), "machine": f"{platform.machine()}, {platform.system()}"}
    for name in _PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found

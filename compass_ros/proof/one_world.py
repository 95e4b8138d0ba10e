"""One sealed world through a method: conceal, calibrate blindly in a process of its own, unseal, compare."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from compass_ros.concealed.comparison import compare
from compass_ros.concealed.seal import unseal
from compass_ros.planning.trials import SHOT, TABLE
from compass_ros.proof.marks import judge
from compass_ros.reporting import read_result
from compass_ros.worlds.scenes import MODULES

LIMIT_S = 3600
"""A calibration that takes longer counts as failed [s]: up to 1041 s were needed, some machines are half as fast."""


@dataclass(frozen=True)
class Suite:
    """A kind of worlds: what `compass conceal` is asked for."""

    name: str
    options: tuple[str, ...]
    first_seed: int
    cell: str = "air_hockey"


SUITES: Mapping[str, Suite] = {
    suite.name: suite
    for suite in (
        Suite("main", (), 134_000),
        Suite("small", ("--rms", "0.5e-3", "--kind", "one"), 22_000),
        Suite("tracker", ("--noise", "tracker"), 33_000),
        Suite("like", ("--forms", "like"), 41_000),
        Suite("table", ("--forms", "foreign"), 711_000),
        *(Suite(cell, (), 721_000 + 10_000 * i, cell) for i, cell in enumerate(MODULES)),
    )
}
"""main: the mix of the table. small: effects of 0.5 mm. tracker: a tracker's noise. like: the library's formulas. Of
other engines (`worlds/`): table, and one suite for each other cell by its name."""
FOREIGN = ("table", *MODULES)
"""Suites of other engines."""


@dataclass(frozen=True)
class Concealed:
    """A world on disk."""

    root: Path
    world: Path
    """The bags."""
    answers: Path
    error: str
    """Why there is none; empty where there is one."""
    seconds: float

    def blindly(self, *words: str) -> tuple[str, float]:
        """A command of the suite that cannot read the answers: what went wrong, and how long it took [s]."""
        blind = [sys.executable, "-m", "compass_ros.concealed.blind", str(self.answers), *words]
        return timed(blind, self.root)


@contextmanager
def concealed(suite: Suite, seed: int) -> Iterator[Concealed]:
    """A world of a suite in a folder that is gone afterwards, made by the real command line."""
    with tempfile.TemporaryDirectory(prefix="compass_proof_") as folder:
        root = Path(folder)
        world, answers = root / "world", root / "answers"
        error, seconds = timed(_conceal(suite, seed, world, answers), root)
        yield Concealed(root, world, answers, f"conceal: {error}" if error else "", seconds)


def _conceal(suite: Suite, seed: int, world: Path, answers: Path) -> list[str]:
    words = ["conceal", "--cell", suite.cell, "--seed", str(seed), "--out", str(world), "--answers", str(answers)]
    return [sys.executable, "-m", "compass_ros.cli", *words, *suite.options]


def run(suite: Suite, seed: int, method: str, threads: int) -> dict[str, object]:
    """Marks of one world, ready for its line; where a step failed, `error` says which and why."""
    with concealed(suite, seed) as made:
        if made.error:
            return {"error": made.error}
        config, out = made.root / "config.json", made.root / "result"
        config.write_text(json.dumps({"threads": threads}), encoding="utf-8")
        asked = {
            "--cell": suite.cell,
            "--method": method,
            "--config": str(config),
            "--progress": "none",
            "--out": str(out),
        }
        given = [word for pair in asked.items() for word in pair]
        error, took = made.blindly("calibrate", str(made.world), *given)
        seconds = {"conceal": made.seconds, "calibrate": took}
        opened = unseal(made.world, made.answers)
        if error:
            truth = [law["name"] for law in _listed(opened.answer, "laws" if suite.name in FOREIGN else "effects")]
            return {"error": f"calibrate: {error}", "seconds": seconds, "kind": opened.answer["kind"], "truth": truth}
        result = read_result(out / "result.json")
        if suite.name in FOREIGN:
            marks = judge(result, opened.answer)
            then = next_experiment(suite, seed, made, out, given) if marks.verdict == "ambiguous" else None
            return {
                "error": None,
                "seconds": seconds,
                "marks": marks.as_json(),
                "next_experiment": then,
                "laws": _listed(opened.answer, "laws"),
                "where": result["mismatch"]["where"],
                "explanations": result["mismatch"]["explanations"][:_SHOWN],
                "sentence": result["mismatch"]["sentence"],
            }
        return {
            "error": None,
            "seconds": seconds,
            "marks": compare(result, opened.answer).as_json(),
            "effects": [{k: e[k] for k in _KEPT} for e in _listed(opened.answer, "effects")],
            "numerics_rms_m": opened.answer["numerics_rms_m"],
            "where": result["mismatch"]["where"],
            "found": result["mismatch"]["effects"],
            "sentence": result["mismatch"]["sentence"],
            "rollouts": result["budget"]["rollouts"],
        }


def next_experiment(
    suite: Suite, seed: int, made: Concealed, out: Path, given: Sequence[str]
) -> dict[str, object] | None:
    """What became of an ambiguous verdict once the same world had played the experiment that it proposed; None where
    that is another measurement, which no world plays."""
    commands = next((out / name for name in (SHOT, TABLE) if (out / name).exists()), None)
    if commands is None:
        return None
    told, result = made.root / "next", made.root / "next_result"
    error, _ = timed([*_conceal(suite, seed, told, made.answers), "--commands", str(commands)], made.root)
    if not error:
        words = [str(result) if word == str(out) else word for word in given]
        error, _ = made.blindly("calibrate", str(made.world), str(told), *words)
    if error:
        return {"error": error, "resolved": False}
    marks = judge(read_result(result / "result.json"), unseal(told, made.answers).answer)
    return {"error": None, "resolved": marks.right and marks.verdict == "named", "marks": marks.as_json()}


_SHOWN = 5
"""Explanations that a line keeps."""
_KEPT = ("name", "objects", "channel", "centre_m", "library", "shape", "size", "rms_m", "rms_before_m", "twins")


def _listed(answer: Mapping[str, object], name: str) -> list[Mapping[str, object]]:
    found = answer[name]
    assert isinstance(found, list)
    return found


def timed(command: list[str], folder: Path, limit_s: float = LIMIT_S) -> tuple[str, float]:
    """Run a command in a folder: what went wrong, empty where nothing did, and how long it took [s]."""
    began = time.monotonic()
    error = _call(command, folder, limit_s)
    return error, round(time.monotonic() - began, 2)


def _call(command: list[str], folder: Path, limit_s: float) -> str:
    """Run to the end; what went wrong as one line, empty where nothing did. One thread for linear algebra."""
    quiet = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
    try:
        done = subprocess.run(
            command, cwd=folder, env=os.environ | quiet, capture_output=True, text=True, timeout=limit_s, check=False
        )
    except subprocess.TimeoutExpired:
        return f"took longer than {limit_s:g} s"
    said = (done.stderr or done.stdout).strip().splitlines()
    return "" if done.returncode == 0 else f"status {done.returncode}: {said[-1] if said else 'said nothing'}"

"""One sealed world through a method: conceal, calibrate blindly in a process of its own, unseal, compare."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from compass_ros.concealed.comparison import compare
from compass_ros.concealed.seal import unseal
from compass_ros.reporting import read_result

LIMIT_S = 1800
"""A calibration that takes longer counts as failed [s]."""


@dataclass(frozen=True)
class Suite:
    """A kind of worlds: what `compass conceal` is asked for."""

    name: str
    options: tuple[str, ...]
    first_seed: int


SUITES: Mapping[str, Suite] = {
    suite.name: suite
    for suite in (
        Suite("main", (), 1_000),
        Suite("small", ("--rms", "0.5e-3", "--kind", "one"), 20_000),
        Suite("tracker", ("--noise", "tracker"), 30_000),
        Suite("like", ("--forms", "like"), 40_000),
    )
}
"""main: the mix of the table. small: effects of 0.5 mm. tracker: a tracker's noise. like: the library's formulas."""


def run(suite: Suite, seed: int, method: str, threads: int) -> dict[str, object]:
    """Marks of one world, ready for its line; where a step failed, `error` says which and why."""
    with tempfile.TemporaryDirectory(prefix="compass_proof_") as folder:
        root = Path(folder)
        world, answers, out = root / "world", root / "answers", root / "result"
        began = time.monotonic()
        conceal = ["conceal", "--seed", str(seed), "--out", str(world), "--answers", str(answers), *suite.options]
        error = call([sys.executable, "-m", "compass_ros.cli", *conceal], root)
        concealed = time.monotonic()
        if error:
            return {"error": f"conceal: {error}"}
        (root / "config.json").write_text(json.dumps({"threads": threads}), encoding="utf-8")
        given = ["--method", method, "--config", str(root / "config.json"), "--progress", "none", "--out", str(out)]
        blind = [sys.executable, "-m", "compass_ros.concealed.blind", str(answers), "calibrate", str(world), *given]
        error = call(blind, root)
        seconds = {"conceal": round(concealed - began, 2), "calibrate": round(time.monotonic() - concealed, 2)}
        opened = unseal(world, answers)
        if error:
            truth = [effect["name"] for effect in _effects(opened.answer)]
            return {"error": f"calibrate: {error}", "seconds": seconds, "kind": opened.answer["kind"], "truth": truth}
        result = read_result(out / "result.json")
        return {
            "error": None,
            "seconds": seconds,
            "marks": compare(result, opened.answer).as_json(),
            "effects": [{k: e[k] for k in _KEPT} for e in _effects(opened.answer)],
            "numerics_rms_m": opened.answer["numerics_rms_m"],
            "where": result["mismatch"]["where"],
            "found": result["mismatch"]["effects"],
            "sentence": result["mismatch"]["sentence"],
            "rollouts": result["budget"]["rollouts"],
        }


_KEPT = ("name", "objects", "channel", "centre_m", "library", "shape", "size", "rms_m", "rms_before_m", "twins")


def _effects(answer: Mapping[str, object]) -> list[Mapping[str, object]]:
    effects = answer["effects"]
    assert isinstance(effects, list)
    return effects


def call(command: list[str], folder: Path) -> str:
    """Run to the end; what went wrong as one line, empty where nothing did. One thread for linear algebra."""
    quiet = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
    try:
        done = subprocess.run(
            command, cwd=folder, env=os.environ | quiet, capture_output=True, text=True, timeout=LIMIT_S, check=False
        )
    except subprocess.TimeoutExpired:
        return f"took longer than {LIMIT_S} s"
    said = (done.stderr or done.stdout).strip().splitlines()
    return "" if done.returncode == 0 else f"status {done.returncode}: {said[-1] if said else 'said nothing'}"

"""The same worlds through rivals: conceal, let all of them judge blindly in one process, unseal, mark."""

from __future__ import annotations

import json
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from compass_ros.concealed.comparison import judge_names
from compass_ros.concealed.proof.campaign import RunWorld
from compass_ros.concealed.proof.one_world import SUITES, Suite, call
from compass_ros.concealed.seal import unseal

METHOD = "rivals"
"""The method in the lines of the results file."""
PARTS = ("rivals", "calibration", "simulation", "cells", "pipeline.py", "types.py", "config.py")
"""What their numbers depend on."""


def in_processes(threads: int) -> RunWorld:
    """A world by the real command line."""
    return lambda key: run(SUITES[key.suite], key.seed, threads)


def run(suite: Suite, seed: int, threads: int, rivals: Sequence[str] = ()) -> dict[str, object]:
    """Marks of all rivals (or some) on one world, ready for its line; `error` says which step failed and why."""
    with tempfile.TemporaryDirectory(prefix="compass_rivals_") as folder:
        root = Path(folder)
        world, answers, out = root / "world", root / "answers", root / "rivals.json"
        began = time.monotonic()
        conceal = ["conceal", "--seed", str(seed), "--out", str(world), "--answers", str(answers), *suite.options]
        error = call([sys.executable, "-m", "compass_ros.cli", *conceal], root)
        concealed = time.monotonic()
        if error:
            return {"error": f"conceal: {error}"}
        asked = [part for name in rivals for part in ("--rival", name)]
        given = ["rivals", str(world), "--threads", str(threads), "--out", str(out), "--quiet", *asked]
        error = call([sys.executable, "-m", "compass_ros.concealed.blind", str(answers), *given], root)
        seconds = {"conceal": round(concealed - began, 2), "rivals": round(time.monotonic() - concealed, 2)}
        answer: Any = unseal(world, answers).answer
        about = {
            "seconds": seconds,
            "kind": answer["kind"],
            "truth": [effect["name"] for effect in answer["effects"]],
            "rms_m": [effect["rms_m"] for effect in answer["effects"]],
        }
        if error:
            return about | {"error": f"rivals: {error}"}
        said = json.loads(out.read_text(encoding="utf-8"))
        floors = [answer["noise_floor_m"][name] for name in said["episodes"]["held_out"]]
        floor = float(np.sqrt(np.mean(np.square(floors))))
        marks = {name: marked(opinion, answer) for name, opinion in said["rivals"].items()}
        return about | {"error": None, "floor_m": floor, "rivals": marks}


def marked(opinion: Mapping[str, Any], answer: Mapping[str, Any]) -> dict[str, object]:
    """An opinion with `right` and `misnamed`, None for a rival that names nothing."""
    right = misnamed = None
    if opinion["names"] is not None:
        right, misnamed = judge_names(opinion["names"], answer)
    return dict(opinion) | {"right": right, "misnamed": misnamed}

"""The same worlds through rivals: conceal, let all of them judge blindly in one process, unseal, mark."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from compass_ros.concealed.comparison import judge_names
from compass_ros.concealed.seal import unseal
from compass_ros.proof.campaign import RunWorld
from compass_ros.proof.lines import Key
from compass_ros.proof.one_world import SUITES, Suite, concealed

METHOD = "rivals"
"""The method in the lines of the results file."""
PARTS = (
    "rivals",
    "calibration",
    "simulation",
    "cells",
    "posing.py",
    "estimation.py",
    "pipeline.py",
    "types.py",
    "config.py",
)
"""What their numbers depend on."""


def in_processes(threads: int) -> RunWorld:
    """A world by the real command line."""
    return partial(_in_process, threads)


def _in_process(threads: int, key: Key) -> dict[str, object]:
    return run(SUITES[key.suite], key.seed, threads)


def run(suite: Suite, seed: int, threads: int, rivals: Sequence[str] = ()) -> dict[str, object]:
    """Marks of all rivals (or some) on one world, ready for its line; `error` says which step failed and why."""
    with concealed(suite, seed) as made:
        if made.error:
            return {"error": made.error}
        asked = [part for name in rivals for part in ("--rival", name)]
        out = made.root / "rivals.json"
        error, took = made.blindly(
            "rivals", str(made.world), "--threads", str(threads), "--out", str(out), "--quiet", *asked
        )
        answer: Any = unseal(made.world, made.answers).answer
        about = {
            "seconds": {"conceal": made.seconds, "rivals": took},
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

"""The acts of a demonstration: shots through camera, tracker and recorder; then the calibration from their bags."""

from __future__ import annotations

import json
import math
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from compass_ros.cells import Cell
from compass_ros.concealed.seal import seal, unseal
from compass_ros.concealed.stage import draw
from compass_ros.demo.processes import NodeGroup
from compass_ros.demo.shots import draw_shots
from compass_ros.errors import ConfigError, DataError
from compass_ros.types import Progress, Report

MARK = "demo.yaml"
"""What a folder of an earlier demonstration holds; only such a folder is replaced."""


@dataclass(frozen=True)
class Plan:
    """What is demonstrated."""

    cell: Cell
    shots: int
    seed: int | None
    """None: the truth is the `target` of the cell's parameters; else truth, shots and noise are drawn with it."""
    effect: str
    """Name of the concealed physics; `none`; empty: drawn with the seed."""
    method: str
    out: Path
    answers: Path
    """Folder of the sealed answers, outside of `out`."""

    @property
    def bags(self) -> Path:
        return self.out / "bags"

    @property
    def result(self) -> Path:
        return self.out / "calibration"

    @property
    def truth(self) -> Path:
        """The unsealed answer; written when all is over, and nothing reads it but people."""
        return self.out / "truth.json"

    @property
    def logs(self) -> Path:
        return self.out / "logs"


def prepare(plan: Plan) -> None:
    """An empty folder. Raises ConfigError where there is something else than an earlier demonstration."""
    try:
        if plan.out.exists() and any(plan.out.iterdir()):
            if not (plan.out / MARK).is_file():
                raise ConfigError(f"{plan.out}: exists and holds no earlier demonstration; it is not overwritten")
            shutil.rmtree(plan.out)
        plan.logs.mkdir(parents=True)
        shots = draw_shots(plan.cell, plan.shots, plan.seed or 0)
        (plan.out / MARK).write_text(yaml.safe_dump({"shots": list(shots)}), encoding="utf-8")
    except OSError as error:
        raise ConfigError(f"{plan.out}: cannot be written: {error.strerror}") from error


def conceal(plan: Plan) -> Path:
    """Draw what is wrong with the cell and seal it, before any shot; the answer's path. Raises ConfigError."""
    shots = yaml.safe_load((plan.out / MARK).read_text(encoding="utf-8"))["shots"]
    inputs = np.array([[shot[field.name] for field in plan.cell.action] for shot in shots])
    values = None
    if plan.seed is None:
        targets = {p.name: p.target for p in plan.cell.spec.parameters if p.target is not None}
        values = plan.cell.values(targets)
    answer = draw(plan.cell, inputs, plan.seed or 0, values, plan.effect)
    return seal(answer, plan.out, {}, plan.answers)


def play(plan: Plan, answer: Path, nodes: NodeGroup, report: Report) -> tuple[int, ...]:
    """Play and record all shots; the number of messages in each bag.

    The virtual cell, the tracker and the recorder have ended when this returns. Raises DataError where the cell says
    that it has played something else than what is sealed.
    """
    cell = nodes.start("virtual_cell", cell=str(plan.cell.path), answer_file=str(answer), seed=plan.seed or 0)
    tracker = nodes.start("puck_tracker")
    recorder = nodes.start("recorder", directory=str(plan.bags))
    shooter = nodes.start("shooter", pipe=True, cell=str(plan.cell.path), shots_file=str(plan.out / MARK), reveal=True)
    truth: Mapping[str, object] = {}
    messages: list[int] = []
    report(Progress("start the nodes", 0, 0.0, math.nan, math.nan))
    for line in nodes.follow(shooter):
        if "truth" in line:
            truth = line["truth"]
        else:
            messages.append(line["messages"])
            report(Progress("play shots", line["shot"], line["shot"] / line["of"], math.nan, math.nan))
    nodes.stop(cell, tracker, recorder, shooter)
    if truth.get("parameters") != unseal(plan.out, plan.answers).answer["parameters"]:
        raise DataError("the virtual cell has played other parameters than those that were sealed")
    return tuple(messages)


def reveal(plan: Plan) -> Mapping[str, Any]:
    """Open the seal, and leave the answer beside the bags. Raises BagError where it was altered."""
    opened = unseal(plan.out, plan.answers)
    plan.truth.write_text(json.dumps(opened.answer, indent=1), encoding="utf-8")
    return opened.answer


def calibrate(plan: Plan, nodes: NodeGroup, report: Report) -> None:
    """Let the calibrator work on the bags; the result lies in `plan.result`."""
    calibrator = nodes.start(
        "calibrator", method=plan.method, output=str(plan.result), versions=str(plan.out / "versions")
    )
    client = nodes.start(
        "calibration_client",
        pipe=True,
        bags=[str(plan.bags)],
        cell=str(plan.cell.path),
        seed=plan.seed or 0,
        output=str(plan.result),
    )
    for line in nodes.follow(client):
        if "stage" in line:
            gap, sparsity = (math.nan if line[name] is None else line[name] for name in ("gap", "sparsity"))
            report(Progress(line["stage"], line["iteration"], line["share_done"] or 0.0, gap, sparsity))
    nodes.stop(client, calibrator)

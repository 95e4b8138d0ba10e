"""The acts of a demonstration: shots through camera, tracker and recorder; then the calibration from their bags."""

from __future__ import annotations

import math
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import yaml

from compass_ros.cells import Cell
from compass_ros.demo.processes import NodeGroup
from compass_ros.demo.shots import draw_shots
from compass_ros.errors import ConfigError
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
    method: str
    out: Path

    @property
    def bags(self) -> Path:
        return self.out / "bags"

    @property
    def result(self) -> Path:
        return self.out / "calibration"

    @property
    def truth(self) -> Path:
        """What the virtual cell reveals; nothing reads it but people."""
        return self.out / "truth.yaml"

    @property
    def logs(self) -> Path:
        return self.out / "logs"


@dataclass(frozen=True)
class Played:
    """What the shots left."""

    truth: Mapping[str, float]
    """The parameters that the virtual cell had, by name."""
    messages: tuple[int, ...]
    """Messages in each bag."""


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


def play(plan: Plan, nodes: NodeGroup, report: Report) -> Played:
    """Play and record all shots. The virtual cell, the tracker and the recorder have ended when this returns."""
    hidden = ""
    if plan.seed is None:
        file = plan.logs / "hidden_parameters.yaml"
        targets = {p.name: p.target for p in plan.cell.spec.parameters if p.target is not None}
        file.write_text(yaml.safe_dump(targets), encoding="utf-8")
        hidden = str(file)
    cell = nodes.start("virtual_cell", cell=str(plan.cell.path), hidden_parameters_file=hidden, seed=plan.seed or 0)
    tracker = nodes.start("puck_tracker")
    recorder = nodes.start("recorder", directory=str(plan.bags))
    shooter = nodes.start("shooter", pipe=True, cell=str(plan.cell.path), shots_file=str(plan.out / MARK), reveal=True)
    truth: Mapping[str, float] = {}
    messages: list[int] = []
    report(Progress("start the nodes", 0, 0.0, math.nan, math.nan))
    for line in nodes.follow(shooter):
        if "truth" in line:
            truth = line["truth"]
        else:
            messages.append(line["messages"])
            report(Progress("play shots", line["shot"], line["shot"] / line["of"], math.nan, math.nan))
    nodes.stop(cell, tracker, recorder, shooter)
    plan.truth.write_text(yaml.safe_dump(dict(truth), sort_keys=False), encoding="utf-8")
    return Played(truth, tuple(messages))


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
            gap, sparsity = (math.nan if line[name] is None else line[name] for name in ("gap_m", "sparsity"))
            report(Progress(line["stage"], line["iteration"], line["share_done"] or 0.0, gap, sparsity))
    nodes.stop(client, calibrator)

"""Folders of calibrations whose parameters are known, as `compass calibrate` leaves them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Literal

import numpy as np

from compass_ros.cells import Cell
from compass_ros.reporting.result_json import write_result
from compass_ros.simulation.export import write_effects_of, write_scene
from compass_ros.types import Budget, Gap, Graph, Mismatch, ParameterRow, Result, Unit, Verdict


def write_calibration(
    folder: Path,
    cell: Cell,
    given: Mapping[str, float],
    verdict: Verdict = "none",
    held_out: Sequence[str] = (),
    cancelled: bool = False,
    unit: Unit = "m",
) -> Path:
    """A calibration that found the defaults, except for the given parameters."""
    values = cell.values(given)
    gap = Gap(dict.fromkeys((f.name for f in cell.factors), 0.1), 0.01)
    both: dict[Literal["fit", "held_out"], Gap] = {"fit": gap, "held_out": gap}
    rows = tuple(
        ParameterRow(p.name, p.unit, p.default, float(v), 0.01, (p.low, p.high), p.name in given, p.name in given)
        for p, v in zip(cell.parameters, values, strict=True)
    )
    factors = tuple(f.name for f in cell.factors)
    graph = Graph(tuple(p.name for p in cell.parameters), factors, np.zeros((len(rows), len(factors))), 0.5)
    result = Result(
        cell=cell.name,
        method="default",
        seed=0,
        versions={"compass_ros": "0"},
        budget=Budget(1, 1.0, 1.0),
        fit=("shot0",),
        held_out=tuple(held_out),
        gap={"nominal": both, "calibrated": both},
        noise_floor_m=1e-3,
        parameters=rows,
        graph=graph,
        mismatch=Mismatch(verdict, None, (), (), "ten slow shots along the left wall", "Nothing is missing."),
        trace=(),
        replays=(),
        cancelled=cancelled,
        unit=unit,
        time_step_s=cell.time_step,
        friction_holds=cell.holds,
    )
    folder.mkdir(parents=True)
    write_scene(cell, values, folder / "scene.xml")
    write_effects_of(None, None, None, cell, values, folder / "effects.yaml")
    write_result(result, folder / "result.json")
    return folder

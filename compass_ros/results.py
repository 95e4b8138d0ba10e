"""Everything that a calibration leaves on disk: result, report, trajectories, the calibrated scene and the effects."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from compass_ros.cells import Cell
from compass_ros.cells.loading import cells_folder
from compass_ros.discovery import Discovery
from compass_ros.discovery.maps import TableMap
from compass_ros.errors import ConfigError
from compass_ros.reporting import Candidate, ReportExtras, ResidualMap, Scene, Shape, write_report, write_result
from compass_ros.reporting.atomic import write_text
from compass_ros.reporting.kept import RESULT, TRAJECTORIES, write_trajectories
from compass_ros.simulation.export import write_effects_of, write_scene
from compass_ros.types import Result

SCENE, EFFECTS, REPORT = "scene.xml", "effects.yaml", "report.html"


def write_all(
    result: Result, found: Discovery, cell: Cell, out: Path, command: str = "", truth: Mapping[str, float] | None = None
) -> None:
    """Write into `out`, each file whole or not at all; result.json last: where it is, all is there."""
    make_writable(out)
    values = np.array([row.value for row in result.parameters])
    cell = replace(cell, time_step=result.time_step_s, holds=result.friction_holds)
    write_scene(found.simulator.cell if found.simulator else cell, values, out / SCENE)
    write_effects_of(found.simulator, found.values, found.effect_std, cell, values, out / EFFECTS)
    extras = ReportExtras(
        command,
        scene_of(cell),
        tuple(Candidate(t.name, t.channel, t.log_evidence, t.held_out_gain, t.kept, t.note) for t in found.tried),
        _map(found.before),
        _map(found.after),
        dict(truth or {}),
    )
    if cell.path != cells_folder() / f"{cell.name}.yaml":
        result = replace(result, cell_file=os.path.relpath(cell.path, out))
    for name, text in found.files.items():
        write_text(out / name, text)
    write_report(result, out / REPORT, extras)
    write_trajectories(result, out / TRAJECTORIES, extras)
    write_result(result, out / RESULT)


def _map(of_table: TableMap | None) -> ResidualMap | None:
    if of_table is None:
        return None
    return ResidualMap(of_table.label, of_table.unit, of_table.x_m, of_table.y_m, of_table.value)


def make_writable(out: Path) -> None:
    """Make a folder. Raises ConfigError where that, or writing into it, is not possible."""
    try:
        out.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=out):
            pass
    except OSError as error:
        raise ConfigError(f"{out}: cannot be written: {error.strerror}") from error


def scene_of(cell: Cell) -> Scene:
    """What stands still on the table, for drawings; empty for cells without a table."""
    if cell.spec.dynamics != "air_hockey":
        return Scene()
    shapes = (
        Shape("rectangle", "table", (0.0, 0.0), (0.9, 0.45)),
        Shape("circle", "goal", (0.43, 0.0), (0.3, 0.3)),
        Shape("rectangle", "obstacle", (0.1, 0.0), (0.025, 0.18)),
    )
    return Scene(shapes, {"puck1": 0.0255, "puck2": 0.0255})

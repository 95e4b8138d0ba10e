"""From an XML, CSV files and two YAMLs to a report, by the command line alone, as docs/your-own-cell.md says."""

from __future__ import annotations

import json
from pathlib import Path

import mujoco
import numpy as np
import pytest

from test.conftest import Run

SCENE = """<mujoco model="lab">
  <option timestep="0.002"/>
  <worldbody>
    <geom name="floor" type="plane" size="3 3 .1" priority="1" solref="-20000 {damping}"/>
    <body name="ball" pos="0 0 1">
      <freejoint/>
      <geom name="ball" type="sphere" size="0.05" mass="0.2"/>
    </body>
  </worldbody>
</mujoco>"""
IMPORT = """
cell: lab
recordings: [{file: "throw_*.csv", format: csv, name: "{key}"}]
time: {column: time}
tracks: {ball: {quantity: xyz, columns: [x, y, z]}}
"""
CELL = """
name: lab
dynamics: mjcf
model: lab.xml
control_dt_s: 0.05
horizon: 18
objects: [{name: ball, quantity: xyz}]
factors: [ball]
start: [{object: ball, velocity: track, frames: 5, noise: {position: 0.001, velocity: 0.05}}]
parameters:
  - {name: floor@contact@damping, field: 'geom_solref[1]', of: floor, unit: 1/s,
     default: -20, bounds: [-200, -2], half_width: 20}
  - {name: floor@pose@height, field: 'geom_pos[2]', of: floor, unit: m,
     default: 0, bounds: [-0.01, 0.01], half_width: 0.002}
"""


def throws(folder: Path, count: int) -> None:
    """What a camera at 60 Hz sees of a ball on a floor that damps twice as much as the scene says."""
    model = mujoco.MjModel.from_xml_string(SCENE.format(damping=-40))
    rng = np.random.default_rng(0)
    for number in range(1, count + 1):
        data = mujoco.MjData(model)
        data.qpos[2] = rng.uniform(0.5, 1.0)
        data.qvel[:2] = rng.uniform(-0.5, 0.5, 2)
        rows = []
        for frame in range(60):
            while data.time < frame / 60 - 1e-9:
                mujoco.mj_step(model, data)
            rows.append([frame / 60, *(data.qpos[:3] + rng.normal(0, 5e-4, 3))])
        np.savetxt(folder / f"throw_{number}.csv", rows, delimiter=",", header="time,x,y,z", comments="")


def test_a_scene_with_an_endless_name_is_refused_with_one_line(run: Run, tmp_path: Path) -> None:
    (tmp_path / "lab.yaml").write_text(CELL.replace("lab.xml", "x" * 5000))
    status, _, error = run("calibrate", "--cell", tmp_path / "lab.yaml", "--out", tmp_path / "out", tmp_path)
    assert status == 1
    assert "model: String should have at most 200 characters" in error
    assert len(error) < 600


@pytest.mark.slow
def test_a_free_body_from_tables(run: Run, tmp_path: Path) -> None:
    throws(tmp_path, 6)
    (tmp_path / "lab.xml").write_text(SCENE.format(damping=-20))
    (tmp_path / "import.yaml").write_text(IMPORT)
    (tmp_path / "lab.yaml").write_text(CELL)
    status, _, error = run("import", tmp_path / "import.yaml", "--out", tmp_path / "bags")
    assert (status, error) == (0, "")
    words = ("--cell", tmp_path / "lab.yaml", "--out", tmp_path / "result", "--progress", "none")
    status, _, error = run("calibrate", *words, tmp_path / "bags")
    assert (status, error) == (0, "")
    result = json.loads((tmp_path / "result" / "result.json").read_text())
    found = {row["name"]: row for row in result["parameters"]}
    assert found["floor@contact@damping"]["value"] == pytest.approx(-40, rel=0.1)
    assert (result["mismatch"]["verdict"], len(result["episodes"]["fit"])) == ("none", 4)
    assert (tmp_path / "result" / "report.html").is_file()

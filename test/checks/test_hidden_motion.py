"""What is tracked may stand still while the scene moves already: that is no recording that began too early."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from compass_ros.cells import Cell, load
from compass_ros.checks.check import check
from compass_ros.simulation import Simulator
from compass_ros.types import Episode, Track

SCENE = """<mujoco><option timestep="0.002"/><worldbody>
<body name="weight" pos="0 0 1"><joint name="fall" type="slide" axis="0 0 1"/>
  <geom name="weight" type="sphere" size="0.05" mass="0.3"/></body>
<body name="plate" pos="0 0 {height}"><joint name="plate" type="slide" axis="0 0 1" stiffness="60" damping="1"
  springref="0.0327"/><geom name="plate" type="box" size="0.1 0.1 0.02" mass="0.2"/></body></worldbody></mujoco>"""
CELL = """name: dropped
dynamics: mjcf
model: scene.xml
control_dt_s: 0.05
horizon: 16
objects: [{name: plate, quantity: joint}]
factors: [plate]
parameters:
  - {name: plate@dyna@damping, field: dof_damping, of: plate, unit: N s/m,
     default: 1, bounds: [0.1, 5], half_width: 0.3}
"""
NOISE, RATE, START = 2e-4, 100.0, 10**12


def cell(folder: Path, height: float) -> Cell:
    (folder / "scene.xml").write_text(SCENE.format(height=height))
    (folder / "cell.yaml").write_text(CELL)
    return load(folder / "cell.yaml")


def recorded(of: Cell, early_s: float) -> Episode:
    """A recording that begins so long before the weight is let go; the plate is heavier to move than the cell says."""
    rng, time = np.random.default_rng(0), np.arange(0, of.duration, 1 / RATE)
    simulator = Simulator(of, threads=1)
    motion = simulator.observe(np.array([[1.4]]), simulator.inputs(np.zeros((1, 0))), time[None])[0]
    still = np.repeat(motion[:1], round(early_s * RATE), axis=0)
    value = np.concatenate([still, motion])
    stamps = START + np.round(np.arange(len(value)) / RATE * 1e9).astype(np.int64)
    return Episode(
        "one",
        of.name,
        of.hash,
        {},
        START,
        (Track("plate", "joint", stamps, value + NOISE * rng.normal(size=value.shape)),),
    )


@pytest.mark.parametrize("height", [0.9, 0.7, 0.5])
def test_time_0_stays_where_the_weight_is_let_go(height: float, tmp_path: Path) -> None:
    of = cell(tmp_path, height)
    (found,) = check(of, [recorded(of, 0.0)]).episodes
    assert found.start_ns == START


@pytest.mark.parametrize("height", [0.9, 0.7, 0.5])
@pytest.mark.parametrize("early_s", [1.0, 4.0])
def test_and_is_found_in_a_recording_that_begins_before(early_s: float, height: float, tmp_path: Path) -> None:
    of = cell(tmp_path, height)
    checked = check(of, [recorded(of, early_s)])
    assert (checked.episodes[0].start_ns - START) * 1e-9 == pytest.approx(early_s, abs=0.015)
    assert [one.kind for one in checked.findings] == ["late"]


def test_what_moves_at_once_starts_with_the_motion(tmp_path: Path) -> None:
    of = cell(tmp_path, 0.5)
    (tmp_path / "scene.xml").write_text(SCENE.format(height=0.5).replace('springref="0.0327"', 'springref="0.1"'))
    moving = replace(recorded(load(tmp_path / "cell.yaml"), 1.0), cell_hash=of.hash)
    (found,) = check(load(tmp_path / "cell.yaml"), [moving]).episodes
    assert (found.start_ns - START) * 1e-9 == pytest.approx(1.0, abs=0.015)

"""A box slides down a slope, recorded by an equation of its own: its contacts are rough, and nothing is missing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from compass_ros.config import CalibrationConfig
from compass_ros.pipeline import calibrate
from compass_ros.types import Episode, Floats, Track
from test.cells.written import content, parameter, written

SCENE = """
<mujoco>
  <compiler angle="degree"/>
  <option timestep="0.002" cone="elliptic" impratio="10"/>
  <worldbody>
    <geom name="ramp" type="plane" size="4 4 .1" euler="0 15 0" priority="1" friction="0.42 .005 .0001" solref=".01 1"/>
    <body name="crate" pos="0 0 0.0414" euler="0 15 0">
      <freejoint/>
      <geom name="crate" type="box" size="0.12 0.08 0.04" mass="1.5"/>
    </body>
  </worldbody>
</mujoco>
"""
START = {"object": "crate", "velocity": "track", "frames": 9, "noise": {"position": 0.001, "velocity": 0.02}}
FRICTION = parameter("ramp@contact@friction", "geom_friction[0]", "ramp", 0.42, 0.1) | {"bounds": [0.1, 1]}
CELL = content(
    [{"name": "crate", "quantity": "xyz"}], [FRICTION], start=[START], noise_m=0.001, control_dt_s=0.05, horizon=39
)
TRUE, SLOPE, STEP_S, HEIGHT = 0.47, np.deg2rad(15), 1e-3, 0.04
NOISE = 1e-3


def slid(place: Floats, speed: Floats, seconds: float) -> Floats:
    """(F, 2) where a body under dry friction is on the slope, every centisecond: down it, across it [m]."""
    down = 9.81 * np.array([np.sin(SLOPE), 0.0])
    out = []
    for step in range(round(seconds / STEP_S)):
        if step % 10 == 0:
            out.append(place)
        fast = float(np.linalg.norm(speed))
        if fast > 0:
            slower = speed + STEP_S * (down - TRUE * 9.81 * np.cos(SLOPE) * speed / fast)
            stops = slower @ speed <= 0 or float(np.linalg.norm(slower)) < 3e-3
            slower = np.zeros(2) if stops else slower
            place, speed = place + STEP_S * (speed + slower) / 2, slower
    return np.array(out)


def recordings() -> list[Episode]:
    rng, axes = np.random.default_rng(14), np.array([[np.cos(SLOPE), 0, -np.sin(SLOPE)], [0, 1, 0]])
    above, out = HEIGHT * np.array([np.sin(SLOPE), 0, np.cos(SLOPE)]), []
    for n in range(10):
        place, way = rng.uniform(-0.3, 0.3, 2), rng.uniform(-0.9, 0.9) + (np.pi if n % 4 == 3 else 0)
        speed = rng.uniform(1.5, 3.4) * np.array([np.cos(way), np.sin(way)])
        seen = slid(place, speed, 2.0) @ axes + above
        stamps = 10_000_000 * np.arange(len(seen), dtype=np.int64)
        track = Track("crate", "xyz", stamps, seen + rng.normal(0, NOISE, seen.shape))
        out.append(Episode(f"run{n}", "written", "", {}, 0, (track,)))
    return out


@pytest.mark.nightly
def test_its_friction_is_found_and_nothing_is_missing(tmp_path: Path) -> None:
    result, _ = calibrate(recordings(), written(tmp_path, SCENE, CELL), CalibrationConfig(threads=1))
    (row,) = result.parameters
    gap = {where: (of["fit"].rmse_m, of["held_out"].rmse_m) for where, of in result.gap.items()}
    print(row.value, row.std, gap, result.mismatch.sentence)
    assert row.value == pytest.approx(TRUE, abs=0.004)
    assert result.mismatch.verdict == "none", result.mismatch.sentence

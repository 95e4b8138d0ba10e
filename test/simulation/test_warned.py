"""Rollouts that go wrong: counted, said in one line, and nothing printed or written to a log."""

from __future__ import annotations

import re
from pathlib import Path

import mujoco
import numpy as np
import pytest

from compass_ros.simulation import Simulator
from test.cells.written import content, parameter, written

SCENE = """
<mujoco model="swing">
  <option timestep="0.01" integrator="Euler"/>
  <worldbody>
    <body name="arm" pos="0 0 1">
      <joint name="swing" axis="0 1 0" damping="0.01"/>
      <geom name="arm" type="capsule" fromto="0 0 0 0 0 -0.3" size="0.01" mass="0.2"/>
      <body name="tip" pos="0 0 -0.3">
        <joint name="wrist" type="ball" damping="0.001"/>
        <geom name="tip" type="box" size="0.01 0.02 0.05" mass="0.05"/>
      </body>
    </body>
  </worldbody>
  <actuator><motor name="motor" joint="swing"/></actuator>
</mujoco>
"""
SWING = {"name": "swing", "quantity": "joint"}
PUSH = {"name": "push", "unit": "N m", "low": -1, "high": 1, "field": "ctrl", "of": "motor"}
WRONG = {
    "a gear of a billion": ("actuator_gear[0]", "motor", 1.0, 1e9),
    "a spring that no step resolves": ("jnt_stiffness", "swing", 0.0, 1e9),
    "a command that is a thousand billion times itself": ("command_scale", "motor", 1.0, 1e12),
    "gravity of a black hole": ("opt.gravity[2]", "", -9.81, -1e12),
    "a joint that begins at the end of the world": ("start_qvel", "swing", 0.0, 1e12),
}


@pytest.mark.parametrize("wrong", WRONG)
def test_it_is_said_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], wrong: str
) -> None:
    field, of, right, bad = WRONG[wrong]
    monkeypatch.chdir(tmp_path)
    cell = written(tmp_path, SCENE, content([SWING], [parameter("a@b@c", field, of, right)], action=[PUSH]))
    simulator = Simulator(cell, threads=2)
    times = np.tile(np.arange(0, 1.0, 0.1), (20, 1))
    values = np.full((20, 1), right)
    simulator.observe(values, np.full((20, 1), 0.5), times)
    assert simulator.warnings == ()
    values[::4] = bad
    seen = simulator.observe(values, np.full((20, 1), 0.5), times)
    (said,) = simulator.with_effects([]).warnings
    counts = [int(n) for n in re.findall(r"(\d+) times '", said)]
    assert "in 40 rollouts" in said
    assert sum(counts) >= 5, "each of the five has one"
    assert max(counts) <= 5
    assert len(said) < 500
    assert "\n" not in said
    assert np.isfinite(seen).all()
    assert capfd.readouterr() == ("", "")
    assert not (tmp_path / "MUJOCO_LOG.TXT").exists()


def test_whoever_listened_before_listens_again(tmp_path: Path) -> None:
    heard: list[str] = []
    mujoco.set_mju_user_warning(heard.append)
    try:
        cell = written(
            tmp_path, SCENE, content([SWING], [parameter("a@b@c", "actuator_gear[0]", "motor", 1.0)], action=[PUSH])
        )
        simulator = Simulator(cell, threads=1)
        simulator.observe(np.array([[1e9]]), np.array([[1.0]]), np.array([[0.0, 0.5]]))
        assert len(simulator.warnings) == 1
        assert heard == []
        model = mujoco.MjModel.from_xml_path(str(cell.model_path))
        data = mujoco.MjData(model)
        data.qvel[:] = np.inf
        mujoco.mj_step(model, data)
        assert len(heard) == 1
    finally:
        mujoco.set_mju_user_warning(None)

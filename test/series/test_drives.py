"""Recorded inputs drive the simulation as MuJoCo's own loop would be driven with them."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from compass_ros.cells import load
from compass_ros.cells.drives import Drive, Drives, held
from compass_ros.errors import ConfigError
from compass_ros.simulation import Simulator
from compass_ros.types import Floats
from test.series.arms import ARM, CELL, PARAMETERS, TRUE, command, play, write_cell

STEP = 0.002


def simulate(cell_path: Path, drive: Drive, seconds: float) -> Floats:
    """(F, C) observations every 20 ms, from the scene's own first state."""
    cell = load(cell_path)
    simulator = Simulator(cell, threads=1).driven([drive])
    inputs = np.zeros((1, len(cell.input_names)))
    inputs[0, cell.input_names.index("joints.shoulder.angle")] = 0.0
    time = np.arange(0, seconds, 0.02)[None]
    return np.asarray(simulator.observe(simulator.defaults[None], inputs, time)[0])


def test_targets_are_held_as_in_mujocos_own_loop(tmp_path: Path) -> None:
    time, target = command(2.0, 3)
    model = mujoco.MjModel.from_xml_string(ARM.format(**TRUE))
    path = write_cell(tmp_path, CELL)
    found = simulate(path, Drive((time,), (target,)), 2.0)
    assert np.abs(found - play(model, time, target)).max() < 1e-12


@pytest.mark.parametrize("delay_s", [0.01, 0.02, 0.05, 0.1, 0.15])
def test_a_delay_of_whole_steps_is_a_late_command(tmp_path: Path, delay_s: float) -> None:
    time, target = command(2.0, 4)
    model = mujoco.MjModel.from_xml_string(ARM.format(**TRUE))
    late = CELL.replace("of: [shoulder, elbow]}\nsignals", f"of: [shoulder, elbow], delay_s: [0, {delay_s}]}}\nsignals")
    found = simulate(write_cell(tmp_path, late), Drive((time,), (target,)), 2.0)
    assert np.abs(found - play(model, time, target, delay_s)).max() < 1e-9


def test_motion_is_smooth_in_a_delay(tmp_path: Path) -> None:
    """A tenth of a time step counts a tenth of one."""
    time, target = command(1.0, 5)
    cell = load(write_cell(tmp_path))
    simulator = Simulator(cell, threads=1).driven([Drive((time,), (target,))])
    delays = 0.03 + STEP * np.linspace(0, 1, 11)
    values = np.tile(simulator.defaults, (len(delays), 1))
    values[:, cell.index("elbow@actuation@delay")] = delays
    inputs = np.zeros((len(delays), len(cell.input_names)))
    end = simulator.observe(values, inputs, np.full((len(delays), 1), 0.9))[:, 0, 1]
    moved, share = end - end[0], np.linspace(0, 1, 11)
    assert abs(moved[-1]) > 1e-5
    assert np.abs(moved - share * moved[-1]).max() < 0.02 * abs(moved[-1])


@pytest.mark.parametrize("hold", ["zero", "linear"])
@pytest.mark.parametrize("seed", range(5))
def test_the_mean_over_a_step_is_that_of_the_series(seed: int, hold: str) -> None:
    """Beside the mean of a thousand points in each step; stamps at any times, late by any delay."""
    rng = np.random.default_rng(seed)
    time = np.sort(rng.uniform(0.05, 1.0, 40))
    value = rng.normal(0, 1, (40, 2))
    edges, delay = STEP * np.arange(600), np.array([0.0, rng.uniform(0, 0.2)])
    found = held(time, value, edges, delay, hold == "linear")
    inside = (np.arange(1000) + 0.5) / 1000
    for column in range(2):
        at = (edges[:-1, None] + STEP * inside) - delay[column]
        if hold == "zero":
            points = value[np.maximum(np.searchsorted(time, at, side="right") - 1, 0), column]
        else:
            points = np.interp(at, time, value[:, column])
        assert np.abs(found[:, column] - points.mean(axis=1)).max() < 5e-3 * np.abs(np.diff(value[:, column])).max()


def test_forces_wrenches_and_mocap_poses(tmp_path: Path) -> None:
    """Every kind of input at once, beside MuJoCo's own fields set in its loop."""
    path = write_cell(
        tmp_path,
        """\
name: arm
dynamics: mjcf
model: arm.xml
control_dt_s: 0.02
horizon: 25
inputs:
  - {name: torque, quantity: joint_effort, of: [elbow], to: qfrc, hold: linear, scale: 2.0, offset: 0.1}
  - {name: push, quantity: wrench, to: xfrc, at: [puck]}
  - {name: tool, quantity: pose, to: mocap, at: [hand]}
objects:
  - {name: puck, quantity: pose}
  - {name: hand, quantity: pose}
  - {name: elbow, quantity: joint}
""",
    )
    cell = load(path)
    rng = np.random.default_rng(1)
    time = np.arange(0, 0.5, 0.05)
    torque, push = rng.normal(0, 1, (10, 1)), rng.normal(0, 0.3, (10, 6))
    turn = rng.normal(0, 1, (10, 4))
    tool = np.hstack([rng.normal(0, 0.1, (10, 3)), turn / np.linalg.norm(turn, axis=1, keepdims=True)])
    simulator = Simulator(cell, threads=1).driven([Drive((time,) * 3, (torque, push, tool))])
    seen = np.arange(0, 0.48, 0.02)
    found = simulator.observe(simulator.defaults[None], np.zeros((1, 1)), seen[None])[0]

    model = mujoco.MjModel.from_xml_path(str(tmp_path / "arm.xml"))
    data, rows = mujoco.MjData(model), []
    for now in seen:
        while data.time < now - 1e-9:
            k = np.searchsorted(time, data.time + 1e-9, side="right") - 1
            middle = np.interp(data.time + 0.5 * model.opt.timestep, time, torque[:, 0])
            data.qfrc_applied[model.joint("elbow").dofadr[0]] = 2.0 * middle + 0.1
            data.xfrc_applied[model.body("puck").id] = push[k]
            data.mocap_pos[0], data.mocap_quat[0] = tool[k, :3], tool[k, 3:]
            mujoco.mj_step(model, data)
        k = np.searchsorted(time, now + 1e-9, side="right") - 1
        rows.append(np.concatenate([data.qpos[2:9], tool[k], data.qpos[1:2]]))
    expected = np.array(rows)
    mine = [*range(7), 14]
    assert np.abs(found[:, mine] - expected[:, mine]).max() < 1e-9
    assert np.abs(found[:, 7:14] - expected[:, 7:14]).max() < 1e-9


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("of: [shoulder, elbow]}\nsignals", "of: [shoulder, elbo]}\nsignals"), "no actuator 'elbo'"),
        (("of: [shoulder, elbow]}\nsignals", "of: []}\nsignals"), "say which joints"),
        (("of: [shoulder, elbow]}\nsignals", "of: [shoulder, elbow], scale: [1, 2, 3]}\nsignals"), "expected 1 or 2"),
        (("of: target", "of: targets"), "no input 'targets'"),
        (("input_delay_s[1]", "input_delay_s[2]"), "2 numbers, found index 2"),
        (("of: [shoulder, elbow], noise", "of: [shoulder, wrist], noise"), "no joint 'wrist'"),
        (("windows: {length_s: 2.0}", "windows: {length_s: 2.0}\nhorizon: 3"), "one of them"),
        (("windows: {length_s: 2.0}", ""), "horizon: missing"),
    ],
)
def test_a_mistake_is_one_line(tmp_path: Path, change: tuple[str, str], said: str) -> None:
    text = CELL + PARAMETERS
    assert change[0] in text
    with pytest.raises(ConfigError) as error:
        load(write_cell(tmp_path, text.replace(*change)))
    assert said in str(error.value)
    assert "\n" not in str(error.value)


def test_a_drive_without_inputs_is_the_scenes_own_controls(tmp_path: Path) -> None:
    cell = load(write_cell(tmp_path, CELL))
    drives = Drives(cell, mujoco.MjModel.from_xml_string(ARM.format(**TRUE)))
    controls = np.ones((2, 3, 2))
    assert np.array_equal(drives.fill(controls, np.zeros((2, 0)), np.zeros((2, 5)), (), STEP), controls)

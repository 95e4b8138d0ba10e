"""A calibrated URDF is the calibrated robot, for whoever reads it next; here MuJoCo."""

from __future__ import annotations

import re
from pathlib import Path

import mujoco
import numpy as np
import pytest
import yaml

from compass_ros.targets.control import write_control
from compass_ros.targets.plain_mjcf import Command
from compass_ros.targets.urdf import write_urdf
from compass_ros.types import Floats
from test.conftest import Run
from test.targets.test_plain import SCENE

ROOT = Path(__file__).parents[2]
URDF = """<robot name="two"><link name="base"/>
<link name="upper"><inertial><origin xyz="0 0 -0.2" rpy="0.1 0.2 0.3"/><mass value="1.5"/>
  <inertia ixx="0.02" ixy="0" ixz="0" iyy="0.025" iyz="0" izz="0.01"/></inertial></link>
<link name="lower"><inertial><origin xyz="0.02 0 -0.15"/><mass value="0.7"/>
  <inertia ixx="0.005" ixy="0.0001" ixz="0" iyy="0.005" iyz="0" izz="0.002"/></inertial></link>
<link name="tool"><inertial><origin xyz="0 0 -0.05"/><mass value="0.2"/>
  <inertia ixx="0.0005" ixy="0" ixz="0" iyy="0.0005" iyz="0" izz="0.0002"/></inertial></link>
<joint name="shoulder" type="revolute"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/>
  <limit lower="-3" upper="3" effort="9" velocity="9"/></joint>
<joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0 0 -0.4"/>
  <axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="9" velocity="9"/><dynamics damping="0.1" friction="0"/></joint>
<joint name="fixed" type="fixed"><parent link="lower"/><child link="tool"/><origin xyz="0 0 -0.3"/></joint></robot>"""


SWING = """<robot name="swing"><link name="world"/>
<link name="arm"><inertial><origin xyz="0 0 -0.35"/><mass value="0.2"/>
  <inertia ixx="0.005" ixy="0" ixz="0" iyy="0.005" iyz="0" izz="0.0001"/></inertial></link>
<joint name="swing" type="revolute"><parent link="world"/><child link="arm"/><axis xyz="0 1 0"/>
  <limit lower="-3" upper="3" effort="9" velocity="9"/></joint></robot>"""


def pushed(model: mujoco.MjModel) -> Floats:
    """(5, nv) accelerations in five states of motion, under gravity."""
    rng, out = np.random.default_rng(1), []
    data = mujoco.MjData(model)
    for _ in range(5):
        data.qpos[:], data.qvel[:] = rng.uniform(-1, 1, model.nq), rng.uniform(-2, 2, model.nv)
        mujoco.mj_forward(model, data)
        out.append(data.qacc.copy())
    return np.array(out)


def test_a_written_urdf_accelerates_as_the_calibrated_model(tmp_path: Path) -> None:
    source, out = tmp_path / "two.urdf", tmp_path / "out.urdf"
    source.write_text(URDF, encoding="utf-8")
    model = mujoco.MjModel.from_xml_path(str(source))
    before = pushed(model)
    model.body_mass[1:] *= 1.3
    model.body_inertia[1:] *= 1.2
    model.body_ipos[2] += [0.01, 0.0, 0.02]
    model.dof_damping[:] = 0.3, 0.15
    model.dof_frictionloss[:] = 0.02, 0.01
    model.body_sameframe[:] = mujoco.mjtSameFrame.mjSAMEFRAME_NONE
    mujoco.mj_setConst(model, mujoco.MjData(model))
    said = write_urdf(source, model, out)
    again = mujoco.MjModel.from_xml_path(str(out))
    assert pushed(again) == pytest.approx(pushed(model), rel=1e-9, abs=1e-9)
    assert np.abs(pushed(again) - before).max() > 0.1
    assert [(one.name, one.on) for one in said] == [("inertia", ("tool",))]


def test_gains_of_a_controller_are_those_of_the_servo(tmp_path: Path) -> None:
    model = mujoco.MjModel.from_xml_string(SCENE)
    said = write_control(model, (Command("servo", 0.04),), tmp_path / "pid.yaml")
    text = (tmp_path / "pid.yaml").read_text(encoding="utf-8")
    dofs = yaml.safe_load(text)["pid_controller"]["ros__parameters"]
    assert dofs["gains"] == {"shoulder": {"p": 30.0, "i": 0.0, "d": 1.0}}
    assert text.startswith("# shoulder: acts 0.0400 s late")
    assert [one.fate for one in said] == ["alike", "left out", "left out"]
    # The controller by its formula, on a motor, moves as the servo does.
    motor = SCENE.replace('<position name="servo" joint="shoulder" kp="30" kv="1"/>', '<motor joint="shoulder"/>')
    ways = []
    for xml, is_pid in ((SCENE, False), (motor, True)):
        driven = mujoco.MjModel.from_xml_string(xml)
        data = mujoco.MjData(driven)
        for _ in range(1000):
            gains = dofs["gains"]["shoulder"]
            data.ctrl[0] = gains["p"] * (0.5 - data.qpos[0]) - gains["d"] * data.qvel[0] if is_pid else 0.5
            mujoco.mj_step(driven, data)
        ways.append(data.qpos.copy())
    assert ways[1] == pytest.approx(ways[0], abs=5e-3)


@pytest.mark.slow
def test_a_result_is_exported_by_one_command(tmp_path: Path, run: Run) -> None:
    own = ROOT / "examples" / "own_cell"
    bags = [own / "bags" / f"swing_{number}" for number in (1, 2)]
    cell = ("--cell", own / "pendulum.yaml")
    assert run("calibrate", *cell, "--no-discover", "--progress", "none", "--out", tmp_path, *bags)[0] == 0
    status, out, err = run("export", tmp_path)
    assert (status, err) == (0, "")
    assert "plain.xml" in out
    assert re.search(r"encoder@sensing@offset on swing: left out \(what is measured is [-\d.]+ rad more\)", out)
    mujoco.MjModel.from_xml_path(str(tmp_path / "plain.xml"))
    status, _, err = run("export", tmp_path / "nothing")
    assert status == 1
    assert len(err.splitlines()) == 1


@pytest.mark.slow
def test_zeros_of_encoders_are_said(tmp_path: Path, run: Run) -> None:
    """In the scene they are its joint's ref; a URDF has no word for them."""
    text = (ROOT / "examples" / "own_cell" / "pendulum.yaml").read_text(encoding="utf-8")
    scene = str(ROOT / "examples" / "own_cell" / "pendulum.xml")
    text = text.replace("observed_offset[0]", "joint_zero").replace("pendulum.xml", scene)
    cell, urdf = tmp_path / "cell.yaml", tmp_path / "arm.urdf"
    cell.write_text(text, encoding="utf-8")
    urdf.write_text(SWING, encoding="utf-8")
    bags = [ROOT / "examples" / "own_cell" / "bags" / f"swing_{number}" for number in (1, 2)]
    given = ("--cell", cell, "--no-discover", "--progress", "none", "--out", tmp_path / "out")
    assert run("calibrate", *given, *bags)[0] == 0
    out = run("export", tmp_path / "out", "--urdf", urdf)[1]
    assert "zero of the encoder on swing: exact (the joint's ref" in out
    zero = float(re.findall(r"zero of the encoder on swing: left out \(subtract ([-\d.e]+) from", out)[0])
    assert mujoco.MjModel.from_xml_path(str(tmp_path / "out" / "plain.xml")).qpos0[0] == pytest.approx(zero, rel=1e-3)

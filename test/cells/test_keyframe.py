"""An episode begins where the scene's keyframe says, in everything that a keyframe holds."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import mujoco
import numpy as np
import pytest

from compass_ros.simulation import Simulator
from compass_ros.types import Floats
from test.cells.written import content, parameter, written

SCENE = """
<mujoco model="keyframe">
  <compiler autolimits="true"/>
  <option timestep="0.002" integrator="implicitfast"/>
  <worldbody>
    <body name="hand" mocap="true" pos="0 0.5 1"/>
    <body name="held" pos="0 0.5 1">
      <freejoint name="held"/>
      <geom name="held" type="box" size="0.03 0.02 0.04" mass="0.2" contype="0" conaffinity="0"/>
    </body>
    <body name="arm" pos="0 0 1">
      <joint name="swing" axis="0 1 0" damping="0.05"/>
      <geom name="arm" type="capsule" fromto="0 0 0 0 0 -0.4" size="0.01" mass="0.5"/>
      <body name="tip" pos="0 0 -0.4">
        <joint name="wrist" axis="0 1 0" damping="0.01"/>
        <geom name="tip" type="capsule" fromto="0 0 0 0 0 -0.1" size="0.01" mass="0.1"/>
      </body>
    </body>
  </worldbody>
  <equality><weld name="grasp" body1="hand" body2="held"/></equality>
  <actuator>
    <position name="servo" joint="swing" kp="3" kv="0.1"/>
    <intvelocity name="drive" joint="wrist" kp="2" actrange="-2 2"/>
    <position name="late" joint="wrist" kp="0.5" delay="0.1" nsample="60"/>
  </actuator>
  <keyframe>{keys}</keyframe>
</mujoco>
"""
HELD = "0.1 0.4 1.1 1 0 0 0"
KEYS = {
    "qpos": f'qpos="{HELD} 0.6 -0.2"',
    "qvel": 'qvel="0 0 0 0 0 0 1.5 -2"',
    "ctrl": 'ctrl="0.9 0 0.4"',
    "act": 'act="0.7"',
    "mocap": 'mpos="0.2 0.4 1.3" mquat="0.8 0.6 0 0"',
    "time": 'time="3" qpos="0 0 0 1 0 0 0 0.3 0"',
    "all of them": f'qpos="{HELD} 0.6 -0.2" qvel="0 0 0 0 0 0 1.5 -2" ctrl="0.9 0.1 0.4" act="0.7" mpos="0.2 0.4 1.3"',
}
TIME = np.arange(0, 0.6, 0.02)
TRACKED = [
    {"name": "swing", "quantity": "joint"},
    {"name": "wrist", "quantity": "joint"},
    {"name": "held", "quantity": "pose"},
]
keys = pytest.mark.parametrize("key", KEYS)


def by_mujoco(scene: str, controls: Floats | None = None) -> Floats:
    """(F, 9) of the two joints and the held body, by mj_resetDataKeyframe and mj_step; (F, 3) controls or the key's."""
    model = mujoco.MjModel.from_xml_string(scene)
    data, seen = mujoco.MjData(model), []
    mujoco.mj_resetDataKeyframe(model, data, 0)
    data.time = 0
    for frame, moment in enumerate(TIME):
        while data.time < moment - 1e-9:
            if controls is not None:
                data.ctrl[:] = controls[frame - 1]
            mujoco.mj_step(model, data)
        seen.append([*data.qpos[7:], *data.qpos[:7]])
    return np.array(seen)


def simulated(folder: Path, scene: str, action: Sequence[object] = (), command: Sequence[float] = ()) -> Floats:
    cell = written(folder, scene, content(TRACKED, action=action))
    return np.asarray(Simulator(cell, threads=1).observe(cell.defaults[None], np.array([command]), TIME[None])[0])


@pytest.mark.parametrize("name", ["start", "home"])
@keys
def test_it_begins_as_mujoco_resets_to_the_keyframe(tmp_path: Path, name: str, key: str) -> None:
    scene = SCENE.format(keys=f'<key name="{name}" {KEYS[key]}/>')
    assert np.abs(simulated(tmp_path, scene) - by_mujoco(scene)).max() < 1e-9
    plain = SCENE.format(keys='<key name="elsewhere"/>')
    assert np.abs(by_mujoco(scene) - by_mujoco(plain)).max() > 0.05, "the key says something"


def test_start_goes_before_home_and_other_names_say_nothing(tmp_path: Path) -> None:
    other, home, start = (f'<key name="{n}" ctrl="{c} 0 0"/>' for n, c in (("other", 9), ("home", 2), ("start", 1)))
    with_all = simulated(tmp_path, SCENE.format(keys=other + home + start))
    assert np.abs(with_all - by_mujoco(SCENE.format(keys=start))).max() < 1e-9
    without = simulated(tmp_path, SCENE.format(keys=other))
    assert np.abs(without - by_mujoco(SCENE.format(keys='<key name="zero"/>'))).max() < 1e-9


def test_a_command_takes_the_keyframes_place_while_it_lasts(tmp_path: Path) -> None:
    scene = SCENE.format(keys='<key name="home" ctrl="0.9 0 0.4"/>')
    command = {
        "name": "reach",
        "unit": "rad",
        "low": -2,
        "high": 2,
        "field": "ctrl",
        "of": "servo",
        "from_s": 0.1,
        "until_s": 0.3,
    }
    told = np.tile([0.9, 0.0, 0.4], (len(TIME), 1))
    told[5:15, 0] = -1.2
    assert np.abs(simulated(tmp_path, scene, [command], [-1.2]) - by_mujoco(scene, told)).max() < 1e-9


def test_what_was_measured_or_commanded_goes_before_the_keyframe(tmp_path: Path) -> None:
    scene = SCENE.format(keys=f'<key name="start" {KEYS["all of them"]}/>')
    begin = {"name": "angle", "unit": "rad", "low": -2, "high": 2, "field": "qpos", "of": "swing"}
    seen = simulated(tmp_path, scene, [begin], [-0.5])
    assert seen[0, :2].tolist() == [-0.5, -0.2]
    cell = written(tmp_path, scene, content(TRACKED, start=[{"object": "wrist"}]))
    step = np.array([[0.0, 0.002]])
    seen = Simulator(cell, threads=1).observe(cell.defaults[None], np.array([[0.3, 0.0]]), step)[0]
    assert seen[0, :2].tolist() == [0.6, 0.3]
    model = mujoco.MjModel.from_xml_string(scene)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    data.joint("wrist").qpos, data.joint("wrist").qvel = 0.3, 0.0
    mujoco.mj_step(model, data)
    assert seen[1, 0] == pytest.approx(data.joint("swing").qpos[0], abs=1e-12), "the other joint is the keyframe's"


def test_a_mocap_bodys_place_can_be_tuned_from_where_the_keyframe_has_it(tmp_path: Path) -> None:
    scene = SCENE.format(keys=f'<key name="home" {KEYS["mocap"]}/>')
    place = parameter("hand@pose@x", "body_pos[0]", "hand", default=0.2)
    cell = written(tmp_path, scene, content(TRACKED, [place]))
    values, times = np.array([[0.2], [0.25]]), np.tile([[0.0, 0.5]], (2, 1))
    seen = Simulator(cell, threads=1).observe(values, np.zeros((2, 0)), times)
    assert seen[0, 1] == pytest.approx(by_mujoco(scene)[25], abs=1e-9)
    assert seen[1, 1, 2] - seen[0, 1, 2] == pytest.approx(0.05, abs=0.005)

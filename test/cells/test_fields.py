"""Each tunable field, against MuJoCo's own compiler given the changed XML."""

from __future__ import annotations

import re
from pathlib import Path

import mujoco
import numpy as np
import pytest

from compass_ros.simulation import Simulator
from compass_ros.types import Floats
from test.cells.written import PENDULUM, SERVO, TOSS, content, parameter, written

STATE = np.array([0.0, 0.0, 0.12, 0.9, 0.3, 0.2, 0.1, 0.4, 0.1, -1.0, 3.0, -2.0, 1.0])
CASES = [
    ("geom_friction[0]", "cube", 2.0, 'name="cube" type="box"', 'name="cube" friction="2" type="box"'),
    ("geom_size[0]", "cube", 0.08, 'size="0.05 0.05 0.05"/>', 'size="0.08 0.05 0.05"/>'),
    ("geom_solref[0]", "cube", 0.1, 'name="cube" type="box"', 'name="cube" solref="0.1" type="box"'),
    ("geom_solimp[0]", "cube", 0.5, 'name="cube" type="box"', 'name="cube" solimp="0.5" type="box"'),
    ("geom_pos[2]", "table", 0.03, 'size="1 1 0.1"', 'size="1 1 0.1" pos="0 0 0.03"'),
    ("geom_turn[0]", "table", 0.2, 'size="1 1 0.1"', 'size="1 1 0.1" euler="11.459155902616466 0 0"'),
    ("dof_damping", "cube", 0.05, '<freejoint name="cube"/>', '<joint type="free" name="cube" damping="0.05"/>'),
    ("opt.gravity[2]", "", -3.0, "<option", '<option gravity="0 0 -3"'),
    ("opt.density", "", 300.0, "<option", '<option density="300"'),
    ("opt.cone", "", 1.0, "<option", '<option cone="elliptic"'),
    ("geom_condim", "cube", 6.0, 'name="cube" type="box"', 'name="cube" condim="6" type="box"'),
]


def trajectory(scene: str) -> Floats:
    model = mujoco.MjModel.from_xml_string(scene)
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = STATE[:7], STATE[7:]
    data.qpos[3:] /= np.linalg.norm(data.qpos[3:])
    out = []
    for _ in range(40):
        for _ in range(10):
            mujoco.mj_step(model, data)
        out.append(data.qpos.copy())
    return np.array(out)


@pytest.mark.parametrize(("field", "of", "value", "old", "new"), CASES, ids=[c[0] for c in CASES])
def test_a_field_does_what_the_xml_would(tmp_path: Path, field: str, of: str, value: float, old: str, new: str) -> None:
    start = [{"object": "cube"}]
    spec = content([{"name": "cube", "quantity": "pose"}], [parameter("p", field, of, value)], start=start)
    cell = written(tmp_path, TOSS, spec)
    inputs = np.concatenate([STATE, np.zeros(3)])[None]
    seen = Simulator(cell, threads=1).observe(np.array([[value]]), inputs, 0.01 * np.arange(1, 41)[None])[0]
    expected = trajectory(TOSS.replace(old, new, 1))
    assert old in TOSS
    assert np.abs(seen - expected).max() < 1e-9
    assert np.abs(expected - trajectory(TOSS)).max() > 1e-3, "the field matters here"


@pytest.mark.parametrize(
    ("field", "of", "value", "attribute"),
    [
        ("body_mass", "arm2", 0.2, {"mass": '"0.12"'}),
        ("body_pos[2]", "arm2", -0.15, {"pos": '"0 0 -0.17"'}),
        ("dof_armature", "joint1", 0.001, None),
        ("qpos_spring", "joint2", 0.3, None),
    ],
)
def test_pendulum_fields(tmp_path: Path, field: str, of: str, value: float, attribute: dict[str, str] | None) -> None:
    scene = PENDULUM.replace('damping="0.0001"', 'damping="0.0001" stiffness="0.05"')
    objects = [{"name": "joint1", "quantity": "joint"}, {"name": "joint2", "quantity": "joint"}]
    start = [{"object": "joint1"}, {"object": "joint2"}]
    cell = written(tmp_path, scene, content(objects, [parameter("p", field, of, value)], start=start))
    time = 0.05 * np.arange(20)[None]
    seen = Simulator(cell, threads=1).observe(np.array([[value]]), np.array([[0.5, 0, 0.2, 0.0]]), time)[0]
    if attribute:
        ((name, old),) = attribute.items()
        changed = f'"{value}"' if name == "mass" else f'"0 0 {value}"'
        scene = scene.replace(f"{name}={old}", f"{name}={changed}", 1)
    else:
        word = {"dof_armature": "armature", "qpos_spring": "springref"}[field]
        scene = re.sub(f'name="{of}"', f'name="{of}" {word}="{value}"', scene)
        scene = scene.replace("<option", '<compiler angle="radian"/><option')
    model = mujoco.MjModel.from_xml_string(scene)
    data = mujoco.MjData(model)
    data.qpos[:] = 0.5, 0.2
    expected = [data.qpos.copy()]
    for _ in range(19):
        for _ in range(50):
            mujoco.mj_step(model, data)
        expected.append(data.qpos.copy())
    assert np.abs(seen - np.array(expected)).max() < 1e-9


def test_an_inertial_frame_that_was_the_bodys_own_can_move(tmp_path: Path) -> None:
    """MuJoCo takes the inertia of a sphere about its centre for diagonal; a tuned centre of mass must undo that."""
    scene = TOSS.replace('type="box" size="0.05 0.05 0.05"', 'type="sphere" size="0.05"')
    spec = content([{"name": "cube", "quantity": "pose"}], [parameter("p", "body_ipos[0]", "cube", 0.02)])
    cell = written(tmp_path, scene, spec | {"start": [{"object": "cube"}]})
    state = STATE.copy()
    state[2:3] = 2.0
    inputs = np.concatenate([state, np.zeros(3)])[None]
    seen = Simulator(cell, threads=1).observe(np.array([[0.02]]), inputs, np.array([[0.0, 0.3]]))[0]
    model = mujoco.MjModel.from_xml_string(scene.replace('<inertial pos="0 0 0"', '<inertial pos="0.02 0 0"'))
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = state[:7], state[7:]
    data.qpos[3:] /= np.linalg.norm(data.qpos[3:])
    for _ in range(300):
        mujoco.mj_step(model, data)
    assert np.abs(seen[1] - data.qpos).max() < 1e-7


def test_a_contact_takes_the_mean_of_its_partners(tmp_path: Path) -> None:
    parameters = [
        parameter("cart@dyna@damping", "contact_solref[1]", "cart", -10.0),
        parameter("stop@dyna@damping", "contact_solref[1]", "stop", -10.0),
    ]
    action = [{"name": "push", "unit": "m/s", "low": 0, "high": 9, "field": "qvel", "of": "rail"}]
    cell = written(
        tmp_path,
        SERVO.replace('kv="20"', 'kv="0"'),
        content([{"name": "cart", "quantity": "xy"}], parameters, action=action),
    )
    values = np.array([[-4.0, -16.0], [-10.0, -10.0], [-10.0, -4.0]])
    x = Simulator(cell, threads=1).observe(values, np.full((3, 1), 4.0), np.full((3, 1), 0.9))[:, 0, 0]
    assert x[0] == pytest.approx(x[1], abs=1e-9)
    assert x[2] < x[1] - 1e-3, "less damping throws it back farther"

"""Inertia, stated in every way that MJCF and URDF have: all of it can be tuned, and nothing moves by itself."""

from __future__ import annotations

import copy
from pathlib import Path

import mujoco
import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

from compass_ros.cells import Cell, load
from compass_ros.cells.inertia import mass_matrix
from compass_ros.cells.made_inertias import moments
from compass_ros.cells.registry import dynamics_of
from compass_ros.simulation.export import write_scene
from compass_ros.types import Floats
from test.cells.written import content, differing, parameter

_LINK = '<joint name="swing" {joint} damping="0.01"/><geom name="link" type="box" size="0.02 0.03 0.1" {geom}/>'


def scene(inertial: str, compiler: str = "", joint: str = 'axis="0 1 0"', geom: str = 'mass="0.3"') -> str:
    body = inertial + _LINK.format(joint=joint, geom=geom)
    more = '<body name="other"><joint name="slide" type="slide" axis="1 0 0"/><geom size="0.05" mass="0.8"/></body>'
    bodies = f'<body name="arm" pos="0 0 1">{body}</body>{more}'
    return f"<mujoco><compiler {compiler}/><worldbody>{bodies}</worldbody></mujoco>"


_FULL = "0.012 0.011 0.003 0.0002 0.0003 -0.0001"
_DIAGONAL = "0.004 0.003 0.002 0 0 0"
_URDF = """
<robot name="arm"><link name="base"/>
  <joint name="swing" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/>
    <limit lower="-3" upper="3" effort="10" velocity="10"/></joint>
  <link name="arm"><inertial><origin xyz="0.05 0 -0.1" rpy="{rpy}"/><mass value="0.4"/>
    <inertia ixx="0.012" iyy="0.011" izz="0.003" ixy="{off}" ixz="0.0003" iyz="-0.0001"/></inertial></link>
</robot>
"""
SCENES = {
    "full": scene(f'<inertial pos="0.01 0 -0.1" mass="0.5" fullinertia="{_FULL}"/>'),
    "full, centred": scene(f'<inertial pos="0 0 0" mass="0.5" fullinertia="{_FULL}"/>'),
    "full, along the axes": scene(f'<inertial pos="0 0 0" mass="0.5" fullinertia="{_DIAGONAL}"/>'),
    "full, free": scene(f'<inertial pos="0 0 0" mass="0.5" fullinertia="{_DIAGONAL}"/>', joint='type="free"'),
    "diagonal": scene('<inertial pos="0 0 0" mass="0.5" diaginertia="0.004 0.003 0.002"/>'),
    "turned": scene('<inertial pos="0 0.02 0" euler="20 30 40" mass="0.5" diaginertia="0.004 0.003 0.002"/>'),
    "turned, by radians": scene(
        '<inertial pos="0 0 0" axisangle="1 0 0 0.3" mass="0.5" diaginertia="0.004 0.003 0.002"/>', 'angle="radian"'
    ),
    "from geoms": scene(""),
    "geoms above what is stated": scene(
        f'<inertial pos="0.1 0 0" mass="0.5" fullinertia="{_FULL}"/>', 'inertiafromgeom="true"'
    ),
    "total mass": scene(f'<inertial pos="0 0 0" mass="0.5" fullinertia="{_DIAGONAL}"/>', 'settotalmass="3"'),
    "balanced": scene('<inertial pos="0 0 0" mass="0.5" diaginertia="0.009 0.003 0.002"/>', 'balanceinertia="true"'),
    "at least": scene("", 'boundmass="0.7" boundinertia="0.01"'),
    "flat": scene('<inertial pos="0 0 0" mass="0.5" diaginertia="0.005 0.003 0.002"/>'),
    "URDF": _URDF.format(rpy="0 0 0", off="0.0002"),
    "URDF, turned": _URDF.format(rpy="0.1 0.2 0.3", off="0"),
}
inertials = pytest.mark.parametrize("inertial", SCENES)


def cell_of(folder: Path, inertial: str, parameters: list[dict[str, object]], auto: bool) -> Cell:
    name = "scene.urdf" if "URDF" in inertial else "scene.xml"
    (folder / name).write_text(SCENES[inertial])
    arm = {"name": "arm", "quantity": "pose"}
    (folder / "cell.yaml").write_text(yaml.safe_dump(content([arm], parameters, model=name, auto=auto)))
    return load(folder / "cell.yaml")


def scene_of(cell: Cell) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_path(str(cell.model_path))


def about_the_frame(model: mujoco.MjModel, body: str) -> Floats:
    """(3, 3) inertia about the centre, in the axes of the body [kg m^2]."""
    turn = Rotation.from_quat(model.body(body).iquat[[1, 2, 3, 0]]).as_matrix()
    return np.asarray(turn @ np.diag(model.body(body).inertia) @ turn.T)


@inertials
def test_with_auto_the_model_is_the_scene_and_each_written_number_comes_back(tmp_path: Path, inertial: str) -> None:
    cell = cell_of(tmp_path, inertial, [], auto=True)
    model = copy.copy(dynamics_of(cell).model)
    dynamics_of(cell).apply([model], cell.defaults[None])
    mujoco.mj_setConst(model, mujoco.MjData(model))
    assert differing(model, scene_of(cell)) == set()
    values = np.array([min(p.default + p.half_width, p.high) for p in cell.parameters])
    out = tmp_path / "out"
    out.mkdir()
    for numbers in (cell.defaults, values):
        write_scene(cell, numbers, out / "scene.xml")
        again = mujoco.MjModel.from_xml_path(str(out / "scene.xml"))
        dynamics_of(cell).apply([model], numbers[None])
        for body in [model.body(i).name for i in range(1, model.nbody)]:
            assert again.body(body).mass == pytest.approx(model.body(body).mass, rel=1e-12)
            assert again.body(body).ipos == pytest.approx(model.body(body).ipos, abs=1e-12)
            assert about_the_frame(again, body) == pytest.approx(about_the_frame(model, body), abs=1e-12)


@inertials
def test_a_centre_of_mass_moves_what_it_should_and_nothing_else(tmp_path: Path, inertial: str) -> None:
    first = scene_of(cell_of(tmp_path, inertial, [], auto=False)).body("arm").ipos
    places = [parameter(f"arm@dyna@{axis}", f"body_ipos[{i}]", "arm", float(first[i])) for i, axis in enumerate("xyz")]
    hinge = parameter("swing@pose@x", "jnt_pos[0]", "swing", 0.0) if "free" not in inertial else None
    cell = cell_of(tmp_path, inertial, [*places, *([hinge] if hinge else [])], auto=False)
    model, plain = copy.copy(dynamics_of(cell).model), scene_of(cell)
    dynamics_of(cell).apply([model], cell.defaults[None])
    mujoco.mj_setConst(model, mujoco.MjData(model))
    assert all(getattr(model, name).dtype.kind != "f" for name in differing(model, plain)), "structure alone"
    data, mass = mujoco.MjData(model), float(plain.body("arm").mass[0])
    moved = cell.defaults.copy()
    moved[:3] += [0.05, -0.03, 0.02]
    dynamics_of(cell).apply([model], moved[None])
    mujoco.mj_setConst(model, data)
    mujoco.mj_forward(model, data)
    row = mass_matrix(model, data)
    assert data.body("arm").xipos - data.body("arm").xpos == pytest.approx(moved[:3], abs=1e-12)
    if "free" not in inertial:
        expected = about_the_frame(plain, "arm")[1, 1] + mass * (moved[0] ** 2 + moved[2] ** 2)
        assert row[0, 0] == pytest.approx(expected, rel=1e-9), "Huygens and Steiner"


def test_moments_are_those_of_a_body_of_points() -> None:
    rng = np.random.default_rng(2)
    for _ in range(5):
        mass, point = rng.uniform(0.1, 1, 20), rng.normal(size=(20, 3)) * [0.3, 0.2, 0.0]
        second = (mass[:, None] * point**2).sum(axis=0)
        inertia = np.array([second[1] + second[2], second[0] + second[2], second[0] + second[1]])
        assert moments(inertia) == pytest.approx(second, abs=1e-15)

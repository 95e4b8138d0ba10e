"""Models whose meshes were not handed on are loaded, tuned and exported without them, and that is said."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
import yaml

from compass_ros.cells import load
from compass_ros.cells.registry import dynamics_of
from compass_ros.cells.scene_source import missing_meshes, scene_source
from compass_ros.errors import ConfigError
from compass_ros.simulation.export import write_scene
from test.cells.written import content

LINK = """<inertial><origin xyz="0 0 0.1"/><mass value="0.4"/>
<inertia ixx="0.012" iyy="0.011" izz="0.003" ixy="0" ixz="0" iyz="0"/></inertial>"""
URDF = """<robot name="arm"><link name="base">{base}</link>
<joint name="swing" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/>
<limit lower="-3" upper="3" effort="10" velocity="10"/></joint><link name="arm">{link}{drawn}</link></robot>"""
DRAWN = '<{0}><geometry><mesh filename="{1}"/></geometry></{0}>'
MJCF = """<mujoco><compiler {0}/><asset><mesh name="rod" file="rod.stl"/><mesh file="more/cap.obj"/></asset><worldbody>
<body name="arm"><inertial pos="0 0 0.1" mass="0.4" diaginertia="0.012 0.011 0.003"/>
<joint name="swing" axis="0 1 0"/><geom type="mesh" mesh="rod"/>
<geom name="cap" type="mesh" mesh="cap"/><geom size="0.01"/></body></worldbody></mujoco>"""


def drawn(*files: str) -> str:
    return "".join(DRAWN.format("collision", file) + DRAWN.format("visual", file) for file in files)


SCENES = {
    "package": ("a.urdf", URDF.format(base="", link=LINK, drawn=drawn("package://arm_description/arm.stl")), 1),
    "file": ("a.urdf", URDF.format(base="", link=LINK, drawn=drawn("file:///gone/arm.stl")), 1),
    "base and link": ("a.urdf", URDF.format(base=drawn("base.stl"), link=LINK, drawn=drawn("m/arm.stl")), 2),
    "several on a link": ("a.urdf", URDF.format(base="", link=LINK, drawn=drawn("one.stl", "two.stl", "three.obj")), 3),
    "drawn only": ("a.urdf", URDF.format(base="", link=LINK, drawn=DRAWN.format("visual", "arm.dae")), 0),
    "MJCF": ("a.xml", MJCF.format(""), 2),
    "MJCF with a folder": ("a.xml", MJCF.format('meshdir="meshes"'), 2),
}


@pytest.mark.parametrize("scene", SCENES)
def test_a_scene_without_its_meshes_moves(tmp_path: Path, scene: str) -> None:
    name, text, missing = SCENES[scene]
    (tmp_path / name).write_text(text)
    path = tmp_path / "cell.yaml"
    signal = [{"name": "swing", "quantity": "joint"}]
    path.write_text(yaml.safe_dump(content(signal, [], model=name, auto=True)))
    cell = load(path)
    model = dynamics_of(cell).model
    assert model.body("arm").mass[0] == 0.4
    assert len(cell.parameters) > 5
    assert len(scene_source(tmp_path / name).missing) == missing
    assert missing_meshes(tmp_path / name).startswith(f"{missing} mesh files are not there" if missing else "")
    write_scene(cell, cell.defaults, tmp_path / "out.xml")
    again = mujoco.MjModel.from_xml_path(str(tmp_path / "out.xml"))
    np.testing.assert_array_equal(again.body("arm").inertia, model.body("arm").inertia)


def test_a_mass_that_was_to_come_from_a_mesh_is_missing(tmp_path: Path) -> None:
    (tmp_path / "a.urdf").write_text(URDF.format(base="", link="", drawn=drawn("arm.stl")))
    path = tmp_path / "cell.yaml"
    path.write_text(yaml.safe_dump(content([{"name": "swing", "quantity": "joint"}], [], model="a.urdf")))
    with pytest.raises(ConfigError, match="mass and inertia of moving bodies"):
        load(path)

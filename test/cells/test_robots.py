"""Robots and grippers as robosuite ships them: hundreds of fields under `auto`, none of which changes the model."""

from __future__ import annotations

import copy
import os
from pathlib import Path

import mujoco
import pytest
import yaml

os.environ.setdefault("MUJOCO_GL", "disable")

from robosuite.models.base import MujocoXML
from robosuite.models.grippers import GRIPPER_MAPPING, gripper_factory
from robosuite.models.robots.robot_model import REGISTERED_ROBOTS, create_robot

from compass_ros.cells import Cell, load
from compass_ros.cells.registry import dynamics_of
from compass_ros.simulation.export import write_scene
from test.by_night import but
from test.cells.written import content, differing

pytestmark = pytest.mark.slow

GRIPPERS = [name for name in GRIPPER_MAPPING if name]
_SAME_ARM = ("PandaOmron", "PandaDexRH", "PandaDexLH", "SpotWithArm", "SpotWithArmFloating")
ROBOTS = [name for name in REGISTERED_ROBOTS if name not in (*_SAME_ARM, "LeggedManipulatorModel")]  # a base class
REFUSED = "Robotiq85Gripper"
"""MuJoCo 3.9 does not load it: a mesh stands in it twice."""
HELD = {
    "Panda": "PandaGripper",
    "Sawyer": "RethinkGripper",
    "Kinova3": "Robotiq140Gripper",
    "Jaco": "JacoThreeFingerGripper",
    "XArm7": "XArm7Gripper",
}


def automatic(folder: Path, robot: MujocoXML) -> Cell:
    """The robot's scene as a cell with all of its fields; it tracks a joint, or the last body where there is none."""
    robot.save_model(str(folder / "scene.xml"))
    spec = mujoco.MjSpec.from_file(str(folder / "scene.xml"))
    scalar = [j.name for j in spec.joints if j.type in (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE)]
    tracked = {"name": scalar[0], "quantity": "joint"} if scalar else {"name": spec.bodies[-1].name, "quantity": "xyz"}
    (folder / "cell.yaml").write_text(yaml.safe_dump(content([tracked], auto=True)))
    return load(folder / "cell.yaml")


def assert_same(cell: Cell, scene: mujoco.MjModel) -> None:
    assert len(cell.parameters) > 5 * scene.njnt
    model = copy.copy(dynamics_of(cell).model)
    dynamics_of(cell).apply([model], cell.defaults[None])
    assert differing(model, scene) <= {"tendon_lengthspring"}, "measured by mj_setConst"
    mujoco.mj_setConst(model, mujoco.MjData(model))
    assert differing(model, scene, 1e-12) == set()


def assert_written(cell: Cell, scene: mujoco.MjModel, out: Path) -> None:
    out.mkdir()
    write_scene(cell, cell.defaults, out / "scene.xml")
    again = mujoco.MjModel.from_xml_path(str(out / "scene.xml"))
    assert differing(again, scene, 1e-9) <= {"mesh_pathadr", "tex_pathadr", "site_size"}, "a sphere has one size"


@pytest.mark.parametrize("name", but(GRIPPERS, "PandaGripper", "Robotiq140Gripper", REFUSED))
def test_a_gripper_is_what_it_was(tmp_path: Path, name: str) -> None:
    if name == REFUSED:
        pytest.skip("MuJoCo 3.9 does not load it: a mesh stands in it twice")
    cell = automatic(tmp_path, gripper_factory(name))
    scene = mujoco.MjModel.from_xml_path(str(cell.model_path))
    assert_same(cell, scene)
    assert_written(cell, scene, tmp_path / "out")


@pytest.mark.parametrize("name", but(ROBOTS, "Panda", "GR1"))
def test_a_robot_is_what_it_was(tmp_path: Path, name: str) -> None:
    cell = automatic(tmp_path, create_robot(name))
    assert_same(cell, mujoco.MjModel.from_xml_path(str(cell.model_path)))


@pytest.mark.parametrize("name", but(HELD, "Sawyer"))
def test_a_robot_that_holds_its_gripper_is_what_it_was(tmp_path: Path, name: str) -> None:
    robot = create_robot(name)
    robot.add_gripper(gripper_factory(HELD[name]), robot.eef_name["right"])
    cell = automatic(tmp_path, robot)
    scene = mujoco.MjModel.from_xml_path(str(cell.model_path))
    assert_same(cell, scene)
    assert_written(cell, scene, tmp_path / "out")

"""The calibrated scene and its effects on disk: MuJoCo alone plays them as the simulator does."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from compass_ros.cells.registry import dynamics_of
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import EFFECTS, Attached, attach, read_effects
from compass_ros.simulation.export import write_effects_of, write_scene
from compass_ros.types import Floats
from test.discovery.servo import servo
from test.simulation.table import DESCRIBED, WIDE, cell, simulator


@pytest.fixture
def calibrated() -> Floats:
    """(64,) each parameter somewhere in its bounds."""
    rng = np.random.default_rng(4)
    return np.array([rng.uniform(p.low, p.high) for p in cell().parameters])


def test_the_written_scene_has_every_number_to_the_last_digit(tmp_path: Path, calibrated: Floats) -> None:
    write_scene(cell(), calibrated, tmp_path / "scene.xml")
    written = mujoco.MjModel.from_xml_path(str(tmp_path / "scene.xml"))
    wanted = mujoco.MjModel.from_xml_path(str(cell().model_path))
    dynamics_of(cell()).apply([wanted], calibrated[None])
    mujoco.mj_setConst(wanted, mujoco.MjData(wanted))
    arrays = [n for n in dir(wanted) if isinstance(getattr(wanted, n), np.ndarray)]
    ignored = {"geom_aabb", "geom_sameframe"}  # for broad phase and shortcuts: listed pairs ask for neither
    different = [n for n in arrays if not np.array_equal(getattr(written, n), getattr(wanted, n))]
    assert set(different) <= ignored
    assert (written.opt.gravity == wanted.opt.gravity).all()


def test_a_time_step_that_is_not_the_scenes_is_simulated_and_written(tmp_path: Path, calibrated: Floats) -> None:
    shorter = replace(cell(), time_step=0.00025)
    write_scene(shorter, calibrated, tmp_path / "scene.xml")
    assert mujoco.MjModel.from_xml_path(str(tmp_path / "scene.xml")).opt.timestep == 0.00025
    assert Simulator(shorter, threads=1).time_step == 0.00025
    assert Simulator(shorter, [Attached(EFFECTS["swirl"], ("puck1",))], threads=1).time_step == 0.00025
    assert Simulator(shorter, options={"timestep": 0.001}, threads=1).time_step == 0.001


def test_friction_that_holds_is_simulated_and_written(tmp_path: Path) -> None:
    own = replace(servo(tmp_path, dry=0.3), holds=True)
    held = Simulator(own, threads=1)
    write_scene(own, held.defaults, tmp_path / "scene.xml")
    read = mujoco.MjModel.from_xml_path(str(tmp_path / "scene.xml"))
    plain = Simulator(replace(own, holds=False), threads=1).written(held.defaults)
    for name in ("dof_solref", "dof_solimp"):
        np.testing.assert_array_equal(getattr(read, name), getattr(held.written(held.defaults), name))
        assert not np.array_equal(getattr(read, name), getattr(plain, name))


@pytest.mark.parametrize("shot", [DESCRIBED, WIDE[1]])
def test_scene_and_effects_play_as_the_simulator_does(tmp_path: Path, calibrated: Floats, shot: Floats) -> None:
    for name in ("env@camera@bias_x", "env@camera@bias_y"):
        calibrated[cell().index(name)] = 0.0
    effects = [Attached(EFFECTS["swirl"], ("puck1", "puck2")), Attached(EFFECTS["local_wall"], ("right_wall",))]
    fitted = Simulator(cell(), effects, threads=1)
    values = np.concatenate([calibrated, [0.2, 0.1, 0.0, 0.1, 0.6], [0.003, -0.3]])
    write_scene(cell(), calibrated, tmp_path / "scene.xml")
    write_effects_of(fitted, values, None, cell(), calibrated, tmp_path / "effects.yaml")

    model = mujoco.MjModel.from_xml_path(str(tmp_path / "scene.xml"))
    data = mujoco.MjData(model)
    data.qpos[:2] = shot[:2]
    with attach(model, data, read_effects(tmp_path / "effects.yaml")):
        for command in dynamics_of(cell()).controls(calibrated[None], shot[None], 1500)[0]:
            data.ctrl[:] = command
            mujoco.mj_step(model, data)
    expected = fitted.motion(values[None], shot[None], 1.5).positions[0, -1]
    assert (data.qpos[[2, 3, 5, 6]] + [-0.15, 0, -0.075, -0.075] == expected).all()


def test_without_effects_the_tables_friction_is_written(tmp_path: Path, calibrated: Floats) -> None:
    write_effects_of(None, None, None, cell(), calibrated, tmp_path / "effects.yaml")
    back = read_effects(tmp_path / "effects.yaml")
    assert back.effects == ()
    assert set(back.sliding) == {"puck1", "puck2"}
    for name in ("puck1", "puck2"):
        assert back.sliding[name].friction[0] == calibrated[cell().index(f"{name}@dyna@friction_sliding")]


def test_values_and_errors_of_each_effect_find_their_place(tmp_path: Path) -> None:
    effects = [Attached(EFFECTS["swirl"], ("puck1",)), Attached(EFFECTS["magnus"], ("puck2",))]
    values = np.append(cell().defaults, [1.0, 0.1, 0.2, 0.3, 0.4, 0.5])
    std = np.append(np.zeros(64), [0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
    fitted = simulator().with_effects(effects)
    write_effects_of(fitted, values, std, cell(), cell().defaults, tmp_path / "effects.yaml")
    swirl, magnus = read_effects(tmp_path / "effects.yaml").effects
    assert (swirl.attached, swirl.values) == (effects[0], (1.0, 0.1, 0.2, 0.3, 0.4))
    assert swirl.std == (0.1, 0.2, 0.3, 0.4, 0.5)
    assert (magnus.attached, magnus.values, magnus.std) == (effects[1], (0.5,), (0.6,))


def test_mujoco_writes_other_models_as_before(tmp_path: Path) -> None:
    model = mujoco.MjModel.from_xml_string('<mujoco><option timestep="0.123456789"/></mujoco>')
    mujoco.mj_saveLastXML(str(tmp_path / "before.xml"), model)
    write_scene(cell(), cell().defaults, tmp_path / "scene.xml")
    model = mujoco.MjModel.from_xml_string('<mujoco><option timestep="0.123456789"/></mujoco>')
    mujoco.mj_saveLastXML(str(tmp_path / "after.xml"), model)
    assert (tmp_path / "before.xml").read_text() == (tmp_path / "after.xml").read_text()

"""Every kind of drive: what `auto` adds changes nothing by itself, acts when it is moved, stays when it is written."""

from __future__ import annotations

import copy
from pathlib import Path

import mujoco
import numpy as np
import pytest

from compass_ros.cells import Cell
from compass_ros.cells.registry import dynamics_of
from compass_ros.errors import ConfigError
from compass_ros.simulation import Simulator
from compass_ros.simulation.export import write_scene
from compass_ros.types import Floats
from test.cells.drives import DRIVES
from test.cells.written import content, differing, parameter, written

WRIST = {"name": "wrist", "quantity": "joint"}
UNTIL_S = 0.3
COMMAND = {"name": "command", "unit": "1", "low": 0, "high": 1, "field": "ctrl", "of": "drive", "until_s": UNTIL_S}
TIME = np.arange(0, 0.5, 0.02)
drives = pytest.mark.parametrize("drive", DRIVES)


def automatic(folder: Path, drive: str) -> Cell:
    return written(folder, DRIVES[drive], content([WRIST], action=[COMMAND], auto=True))


def by_hand(model: mujoco.MjModel, command: float) -> Floats:
    """(F,) angle of the wrist, stepped by MuJoCo alone."""
    data, seen = mujoco.MjData(model), []
    for moment in TIME:
        while data.time < moment - 1e-9:
            data.ctrl[:] = command if data.time < UNTIL_S - 1e-9 else 0.0
            mujoco.mj_step(model, data)
        seen.append(float(data.joint("wrist").qpos[0]))
    return np.array(seen)


def of_drive(cell: Cell) -> list[str]:
    return [p.name.rpartition("@")[2] for p in cell.parameters if p.name.startswith("drive@")]


@drives
def test_at_its_defaults_the_model_is_the_scene_to_the_last_bit(tmp_path: Path, drive: str) -> None:
    cell = automatic(tmp_path, drive)
    dynamics, scene = dynamics_of(cell), mujoco.MjModel.from_xml_path(str(cell.model_path))
    model = copy.copy(dynamics.model)
    for _ in range(2):  # what was written before does not matter
        dynamics.apply([model], np.array([[p.high for p in cell.parameters]]))
        dynamics.apply([model], cell.defaults[None])
        mujoco.mj_setConst(model, mujoco.MjData(model))
        assert differing(model, scene) == set()
    for command in (0.4, -0.3):
        seen = Simulator(cell, threads=1).observe(cell.defaults[None], np.array([[command]]), TIME[None])[0, :, 0]
        assert np.abs(seen - by_hand(scene, command)).max() < 1e-9
        assert np.ptp(seen) > 1e-3, "it moves"


@drives
def test_each_number_of_a_drive_moves_the_wrist(tmp_path: Path, drive: str) -> None:
    cell = automatic(tmp_path, drive)
    names = of_drive(cell)
    assert names, "a drive has something that can be wrong"
    assert len(set(names)) == len(names)
    simulator, first = Simulator(cell, threads=1), len(cell.parameters) - len(names)
    values = np.tile(cell.defaults, (1 + len(names), 1))
    for row in range(len(names)):
        p = cell.parameters[first + row]
        values[1 + row, first + row] = p.low if p.name.endswith(("force_high", "force_low")) else p.high
    inputs = np.tile([[250.0 if drive == "gripper" else 2.0]], (len(values), 1))
    seen = simulator.observe(values, inputs, np.tile(TIME, (len(values), 1)))[:, :, 0]
    still = [n for n, moved in zip(names, np.abs(seen[1:] - seen[0]).max(axis=1), strict=True) if not moved > 1e-7]
    assert set(still) <= {"force_low", "force_high"}, "what no command reaches"


@drives
def test_inertias_stay_those_of_a_body_and_signs_what_they_are(tmp_path: Path, drive: str) -> None:
    cell = automatic(tmp_path, drive)
    dynamics, rng = dynamics_of(cell), np.random.default_rng(1)
    model = copy.copy(dynamics.model)
    low, high = (np.array([getattr(p, side) for p in cell.parameters]) for side in ("low", "high"))
    for _ in range(20):
        dynamics.apply([model], np.where(rng.random(len(low)) < 0.5, low, high)[None])
        inertia = model.body_inertia[1:]
        assert (model.body_mass[1:] > 0).all()
        assert (2 * inertia.max(axis=1) <= inertia.sum(axis=1) * (1 + 1e-12)).all()
        assert (model.dof_damping >= 0).all()
        assert (np.sign(model.actuator_gainprm) == np.sign(dynamics.model.actuator_gainprm)).all()
        assert (np.sign(model.actuator_biasprm[:, 1:]) == np.sign(dynamics.model.actuator_biasprm[:, 1:])).all()


@drives
def test_the_written_scene_has_every_number_and_plays_alike(tmp_path: Path, drive: str) -> None:
    cell = automatic(tmp_path, drive)
    values = np.array([min(p.default + p.half_width, p.high) for p in cell.parameters])
    (tmp_path / "out").mkdir()
    write_scene(cell, values, tmp_path / "out" / "scene.xml")
    scene = mujoco.MjModel.from_xml_path(str(tmp_path / "out" / "scene.xml"))
    wanted = copy.copy(dynamics_of(cell).model)
    dynamics_of(cell).apply([wanted], values[None])
    mujoco.mj_setConst(wanted, mujoco.MjData(wanted))
    assert differing(scene, wanted, 1e-12) <= {"bvh_aabb"}, "boxes are not used"
    seen = Simulator(cell, threads=1).observe(values[None], np.array([[0.4]]), TIME[None])[0, :, 0]
    assert np.abs(seen - by_hand(scene, 0.4)).max() < 1e-9


@pytest.mark.parametrize(
    ("drive", "field"), [("DC motor", "servo_gain"), ("DC motor", "command_scale"), ("muscle", "command_scale")]
)
def test_a_number_that_a_drive_does_not_have_is_refused_in_one_line(tmp_path: Path, drive: str, field: str) -> None:
    with pytest.raises(ConfigError, match=rf"{field}: actuator 'drive' has none; its gain is '(dcmotor|muscle)'"):
        written(tmp_path, DRIVES[drive], content([WRIST], [parameter("a@b@c", field, "drive")]))


def test_a_gripper_scales_as_a_whole_and_a_command_without_its_stiffness(tmp_path: Path) -> None:
    share = parameter("drive@actuation@share", "command_scale", "drive", default=1.0)
    gain = parameter("drive@actuation@gain", "servo_gain", "drive", default=0.3)
    cell = written(tmp_path, DRIVES["gripper"], content([WRIST], [share, gain]))
    models = [copy.copy(dynamics_of(cell).model) for _ in range(2)]
    dynamics_of(cell).apply(models, np.array([[1.0, 2 * 0.3137255], [0.5, 2 * 0.3137255]]))
    assert [m.actuator_gainprm[0, 0] for m in models] == pytest.approx([0.627451, 0.3137255])
    assert [m.actuator_biasprm[0, :3].tolist() for m in models] == [pytest.approx([0.02, -200, -10])] * 2

"""What docs/result.md says of zeros of encoders: where a written scene has them, and what to do where one has not."""

from __future__ import annotations

import copy
from pathlib import Path

import mujoco
import numpy as np
import pytest

from compass_ros.cells.loading import cells_folder
from compass_ros.cells.registry import dynamics_of
from compass_ros.simulation.export import write_scene
from compass_ros.types import Floats
from test.cells.written import parameter, written

ZERO = np.array([0.1, -0.2])
BEGIN = np.array([0.3, 0.2])
"""As the encoders show it."""
SERVOS = (cells_folder() / "two_joint_arm_driven.xml").read_text("utf-8")
YAML: dict[str, object] = {
    "name": "written",
    "dynamics": "mjcf",
    "model": "scene.xml",
    "horizon": 10,
    "objects": [{"name": "shoulder", "quantity": "joint"}],
    "parameters": [parameter(f"{name}@sensing@zero", "joint_zero", name) for name in ("shoulder", "elbow")],
}


def played(model: mujoco.MjModel, begin: Floats, minus: Floats) -> Floats:
    """(T, 2) positions under commands from which something is subtracted."""
    data, out = mujoco.MjData(model), []
    data.qpos[:] = begin
    for step in range(800):
        data.ctrl[:] = 0.5 * np.sin(0.004 * step) - minus
        mujoco.mj_step(model, data)
        out.append(data.qpos.copy())
    return np.array(out)


@pytest.fixture
def scenes(tmp_path: Path) -> tuple[mujoco.MjModel, mujoco.MjModel, mujoco.MjModel]:
    """As the cell simulates it, as it is written for others, as it was drawn."""
    cell = written(tmp_path, SERVOS, YAML)
    dynamics = dynamics_of(cell)
    own = copy.copy(dynamics.model)
    dynamics.apply([own], ZERO[None])
    write_scene(cell, ZERO, tmp_path / "out.xml")
    return own, mujoco.MjModel.from_xml_path(str(tmp_path / "out.xml")), mujoco.MjModel.from_xml_string(SERVOS)


def test_the_written_scene_has_the_zeros_and_takes_what_was_recorded(
    scenes: tuple[mujoco.MjModel, mujoco.MjModel, mujoco.MjModel],
) -> None:
    own, out, _ = scenes
    np.testing.assert_allclose(out.qpos0, ZERO)
    np.testing.assert_allclose(played(out, BEGIN, 0.0 * ZERO), played(own, BEGIN, 0.0 * ZERO), atol=1e-9)


def test_a_scene_without_them_takes_positions_and_commands_minus_the_zeros(
    scenes: tuple[mujoco.MjModel, mujoco.MjModel, mujoco.MjModel],
) -> None:
    """A measured angle is the drawing's plus the zero, and so is a command of a position servo."""
    own, _, drawn = scenes
    measured = played(own, BEGIN, 0.0 * ZERO)
    np.testing.assert_allclose(played(drawn, BEGIN - ZERO, ZERO) + ZERO, measured, atol=1e-9)
    assert np.abs(played(drawn, BEGIN - ZERO, 0.0 * ZERO) + ZERO - measured).max() > 0.05, "the commands too"

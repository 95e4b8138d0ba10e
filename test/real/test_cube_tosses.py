"""The loss against one computed here with plain MuJoCo; impacts begin in free flight; the published figure."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from compass_ros.cells import load
from compass_ros.real.cube_tosses import FRAMES, RATE_HZ, _flight_state, held_out, impacts, losses, study
from compass_ros.real.imports import episodes
from compass_ros.simulation import Simulator
from compass_ros.simulation.replay import recordings
from compass_ros.types import Floats

CELL = load("cube_toss")


def oracle(toss: Floats) -> float:
    """Loss of one array of the file, after the words of its README."""
    model = mujoco.MjModel.from_xml_path(str(CELL.model_path))
    data = mujoco.MjData(model)
    data.qpos[:] = np.concatenate([toss[0, :3] * 0.0524, toss[0, 3:7] / np.linalg.norm(toss[0, 3:7])])
    data.qvel[:] = np.concatenate([toss[0, 7:10] * 0.0524, toss[0, 10:13]])
    total = 0.0
    for row in toss:
        there = Rotation.from_quat(row[[4, 5, 6, 3]])
        turned = (Rotation.from_quat(data.qpos[[4, 5, 6, 3]]).inv() * there).magnitude()
        total += float(np.sum((data.qpos[:3] - row[:3] * 0.0524) ** 2) / 0.0524 + turned**2)
        mujoco.mj_step(model, data, 10)
    return total / len(toss)


def test_the_loss_is_that_of_the_readme(some_tosses: Path, tmp_path: Path) -> None:
    tosses = episodes(CELL, "cube_tosses", tmp_path, some_tosses)
    found = losses(Simulator(CELL), recordings(CELL, tosses), CELL.defaults)
    with np.load(some_tosses / "cube_tosses" / "tosses.npz") as arrays:
        expected = [oracle(arrays[str(int(toss.name[-3:]))]) for toss in tosses[:12]]
    close = np.isclose(found[:12], expected, rtol=0.02, atol=1e-4)
    assert close.mean() > 0.8, "a toss may fall on another face after the last bit differs"


def test_impacts_begin_in_free_flight(some_tosses: Path, tmp_path: Path) -> None:
    tosses = [t for t in episodes(CELL, "cube_tosses", tmp_path, some_tosses) if not held_out(t)]
    cut = impacts(tosses)
    assert len(cut) > 30
    data = recordings(CELL, cut)
    assert data.measured.shape[1] == FRAMES
    predicted = Simulator(CELL).observe(np.tile(CELL.defaults, (len(cut), 1)), data.inputs, data.time_s)
    off = np.linalg.norm(predicted[:, :4, :3] - data.measured[:, :4, :3], axis=2)
    assert np.median(off) < 0.001, "the first frames are ballistic"


def test_the_state_of_a_flight() -> None:
    time = np.arange(5) / RATE_HZ
    turned = Rotation.from_rotvec([0.3, -0.2, 0.1]) * Rotation.from_rotvec(np.outer(time, [2.0, -3.0, 1.0]))
    places: Floats = np.array([0.1, -0.2, 0.3]) + np.outer(time, [1.0, 0.5, -2.0]) - np.outer(time**2, [0, 0, 9.81 / 2])
    state = _flight_state(np.hstack([places, turned.as_quat()[:, [3, 0, 1, 2]]]))
    np.testing.assert_allclose(state[:3], [0.1, -0.2, 0.3], atol=1e-12)
    np.testing.assert_allclose(state[7:], [1.0, 0.5, -2.0, 2.0, -3.0, 1.0], atol=1e-9)


@pytest.mark.slow
def test_the_published_loss(real_data: Path, tmp_path: Path) -> None:
    tosses = episodes(CELL, "cube_tosses", tmp_path, real_data)
    assert [len(tosses), sum(map(held_out, tosses))] == [440, 110]
    found = losses(Simulator(CELL), recordings(CELL, tosses), CELL.defaults)
    assert found.mean() == pytest.approx(0.374, rel=0.02)


@pytest.mark.slow
def test_a_short_study(some_tosses: Path, tmp_path: Path) -> None:
    told: list[str] = []
    found = study(tmp_path, some_tosses, told.append, evaluations=44)
    single = {row[0]: float(row[1]) for row in found.tables[0].rows}
    assert single["calibrated"] < single["published, elliptic friction cone"] < single["published"]
    assert len(told) == 11

"""How wrong a first state may be that comes from the first frames: as wrong as a parabola is there."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from compass_ros.cells import Cell
from compass_ros.simulation import Simulator
from compass_ros.simulation.replay import recordings
from compass_ros.types import Episode, Floats, Track
from test.cells.written import content, parameter, written

BEGUN = 1_700_000_000_000_000_000
FRAMES = 9
SCENE = """<mujoco><worldbody><body><joint name="axis" axis="0 1 0"/>
    <geom size="0.05" pos="0 0 -0.2" mass="1"/></body></worldbody></mujoco>"""


def cell(folder: Path, velocity: str = "track", noise: Mapping[str, float] | None = None) -> Cell:
    start = {"object": "axis", "velocity": velocity, "frames": FRAMES}
    start |= {"noise": noise or {"position": 0.001, "velocity": 0.01}}
    made = content(
        [{"name": "axis", "quantity": "joint"}],
        [parameter("axis@dyna@damping", "dof_damping", "axis", 0.01, 0.01)],
        start=[start],
    )
    return written(folder, SCENE, made)


def recorded(motion: Floats, stated: tuple[float, ...] = ()) -> Episode:
    stamps = BEGUN + np.round(np.arange(len(motion)) / 60 * 1e9).astype(np.int64)
    initial = {"axis": stated} if stated else {}
    return Episode("e", "cell", "", {}, BEGUN, (Track("axis", "joint", stamps, motion[:, None]),), initial)


def std(of: Cell, episode: Episode) -> Floats:
    data = recordings(of, [episode])
    simulator = Simulator(of, threads=1)
    return simulator.launch_std(simulator.defaults, data.start_std)


TIME = np.arange(120) / 60


@pytest.mark.parametrize("jerk", [0.0, 10.0, 100.0, -300.0])
def test_it_grows_with_what_a_parabola_gets_wrong(tmp_path: Path, jerk: float) -> None:
    """The true first rate lies within it, of any cubic motion."""
    motion = 0.3 - 0.2 * TIME + 2.0 * TIME**2 + jerk / 6 * TIME**3
    of = cell(tmp_path)
    episode = recorded(motion)
    position, rate = of.inputs(episode)
    stds = std(of, episode)
    assert abs(position - 0.3) < 3 * stds[0]
    assert abs(rate - -0.2) <= np.sqrt(stds[1] ** 2 - 0.01**2) + 1e-9
    assert stds[1] == pytest.approx(np.hypot(0.01, abs(rate + 0.2)), rel=1e-6)


def test_a_parabola_adds_nothing(tmp_path: Path) -> None:
    assert std(cell(tmp_path), recorded(0.3 - TIME + 2 * TIME**2)) == pytest.approx([0.001, 0.01], rel=1e-6)


@pytest.mark.parametrize(
    ("velocity", "noise", "stated", "expected"),
    [
        ("rest", None, (), [0.001, 0.01]),
        ("track", {"position": 0.0, "velocity": 0.0}, (), [0.0, 0.0]),
        ("track", None, (0.3, -0.2), [0.001, 0.01]),
    ],
)
def test_what_is_not_taken_from_the_track_is_as_the_cell_says(
    tmp_path: Path, velocity: str, noise: Mapping[str, float] | None, stated: tuple[float, ...], expected: list[float]
) -> None:
    episode = recorded(0.3 + 20.0 * TIME**3, stated)
    assert std(cell(tmp_path, velocity, noise), episode) == pytest.approx(expected)

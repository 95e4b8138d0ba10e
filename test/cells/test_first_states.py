"""How wrong a first state may be that comes from the first frames: as wrong as a parabola is there."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from compass_ros.cells import Cell
from compass_ros.simulation import Simulator
from compass_ros.simulation.replay import recordings
from compass_ros.types import Episode, Floats, Track
from test.cells.written import TOSS, content, parameter, written

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


@pytest.mark.parametrize("jerk", [0.0, 1.0, 10.0, 100.0, -300.0])
def test_it_grows_with_what_a_parabola_gets_wrong(tmp_path: Path, jerk: float) -> None:
    """The true first rate lies within it, of any cubic motion."""
    motion = 0.3 - 0.2 * TIME + 2.0 * TIME**2 + jerk / 6 * TIME**3
    of = cell(tmp_path)
    episode = recorded(motion)
    position, rate = of.inputs(episode)
    stds = std(of, episode)
    assert abs(position - 0.3) < 3 * stds[0]
    seen = 2.0 if abs(jerk) > 100 else 1.0  # noise would hide the others
    assert stds[1] == pytest.approx(np.hypot(0.01, seen * abs(rate + 0.2)), rel=1e-6)


@pytest.mark.parametrize("rate_hz", [0.5, 1.0, 2.0, 4.0, 8.0])
@pytest.mark.parametrize("frames", [6, 9])
def test_of_fast_motion_it_is_as_large_as_it_says(tmp_path: Path, rate_hz: float, frames: int) -> None:
    """Oscillations from slow ones to those that frames hardly show, each at 60 phases."""
    rng, missed, omega = np.random.default_rng(0), [], 2 * np.pi * rate_hz
    damping = parameter("axis@dyna@damping", "dof_damping", "axis", 0.01, 0.01)
    start = {"object": "axis", "frames": frames}
    of = written(tmp_path, SCENE, content([{"name": "axis", "quantity": "joint"}], [damping], start=[start]))
    for phase in rng.uniform(0, 2 * np.pi, 60):
        episode = recorded(0.3 * np.cos(omega * TIME + phase) + rng.normal(0, 0.001, len(TIME)))
        true = 0.3 * np.array([np.cos(phase), -omega * np.sin(phase)])
        missed.append((of.inputs(episode) - true) / std(of, episode))
    of_each = np.sqrt(np.mean(np.square(missed), axis=0))
    assert np.all(of_each > 0.2)
    assert np.all(of_each < 2.0)


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


@pytest.mark.parametrize("velocity", ["track", "rest"])
def test_where_the_cell_says_nothing_it_is_as_exact_as_the_frames(tmp_path: Path, velocity: str) -> None:
    """Of 400 recordings of one motion with noise, the first states scatter by as much as each of them says."""
    start = {"object": "axis", "velocity": velocity, "frames": 5}
    damping = parameter("axis@dyna@damping", "dof_damping", "axis", 0.01, 0.01)
    made = content([{"name": "axis", "quantity": "joint"}], [damping], start=[start], noise_m=0.002)
    of, rng = written(tmp_path, SCENE, made), np.random.default_rng(0)
    still = 0.3 - 0.2 * TIME if velocity == "track" else np.full(len(TIME), 0.3)
    read = np.array([of.inputs(recorded(still + rng.normal(0, 0.002, len(TIME)))) for _ in range(400)])
    assert std(of, recorded(still)) == pytest.approx(read.std(axis=0), rel=0.12)
    assert std(of, recorded(still, (0.3, -0.2))) == pytest.approx([0.0, 0.0])


def test_so_is_the_first_pose_of_a_body(tmp_path: Path) -> None:
    """The same of a cube that is thrown and turns: position, velocity, a rotation vector and the rate."""
    start = {"object": "cube", "frames": 6}
    mass = parameter("cube@dyna@mass", "body_mass", "cube", 0.37, 0.1)
    of = written(tmp_path, TOSS, content([{"name": "cube", "quantity": "pose"}], [mass], start=[start], noise_m=0.002))
    rng, time = np.random.default_rng(0), TIME[:30]
    place = np.array([0.1, 0.2, 0.5]) + time[:, None] * np.array([1.0, -0.5, 2.0])
    turned = Rotation.from_rotvec(time[:, None] * np.array([0.0, 0.0, 1.0])).as_quat()[:, [3, 0, 1, 2]]

    def thrown(noise: float) -> Episode:
        value = np.concatenate([place, turned], axis=1) + rng.normal(0, noise, (len(time), 7))
        value[:, 3:] /= np.linalg.norm(value[:, 3:], axis=1, keepdims=True)
        stamps = BEGUN + np.round(time * 1e9).astype(np.int64)
        return Episode("e", "cell", "", {}, BEGUN, (Track("cube", "pose", stamps, value),), {})

    said = dict(zip(of.input_names, std(of, thrown(0.0)), strict=True))
    read = np.array([of.inputs(thrown(0.002)) for _ in range(400)])
    scatter = dict(zip(of.input_names, read.std(axis=0), strict=True))
    for name in ("x", "z", "vx", "vz", "wx", "wz"):
        assert said[f"cube.{name}"] == pytest.approx(scatter[f"cube.{name}"], rel=0.15), name
    half = scatter["cube.qx"]
    assert said["cube.rx"] == pytest.approx(2 * half, rel=0.12)
    assert said["cube.qw"] == 0.0


@pytest.mark.parametrize("stated", [{"position": 0.002}, {"position": 0.002, "velocity": 0.05}, {"rate": 0.5}])
def test_what_the_cell_does_not_name_is_as_exact_as_the_frames(tmp_path: Path, stated: dict[str, float]) -> None:
    start = {"object": "cube", "frames": 6}
    mass = parameter("cube@dyna@mass", "body_mass", "cube", 0.37, 0.1)
    noises: list[dict[str, object]] = [{"noise": stated}, {}, {"noise": {}}]
    cells = [
        written(tmp_path, TOSS, content([{"name": "cube", "quantity": "pose"}], [mass], start=[start | noise]))
        for noise in noises
    ]
    still = np.tile([0.1, 0.2, 0.5, 1.0, 0.0, 0.0, 0.0], (30, 1))
    stamps = BEGUN + np.round(TIME[:30] * 1e9).astype(np.int64)
    episode = Episode("e", "cell", "", {}, BEGUN, (Track("cube", "pose", stamps, still),), {})
    some, frames, exact = (dict(zip(of.input_names, std(of, episode), strict=True)) for of in cells)
    groups = {"position": "x", "velocity": "vx", "orientation": "rx", "rate": "wx"}
    for group, name in groups.items():
        assert some[f"cube.{name}"] == pytest.approx(stated.get(group, frames[f"cube.{name}"]))
        assert frames[f"cube.{name}"] > 0
        assert exact[f"cube.{name}"] == 0.0


@pytest.mark.parametrize("change", [0.0, 20.0, -60.0])
def test_a_turn_that_changes_is_read_as_wrong_as_it_says(tmp_path: Path, change: float) -> None:
    """Rate 1 rad/s about z, and so much more in each second."""
    mass = parameter("cube@dyna@mass", "body_mass", "cube", 0.37, 0.1)
    start = {"object": "cube", "frames": 6}
    of = written(tmp_path, TOSS, content([{"name": "cube", "quantity": "pose"}], [mass], start=[start], noise_m=1e-5))
    time = TIME[:30]
    turned = Rotation.from_rotvec((time + 0.5 * change * time**2)[:, None] * np.array([0.0, 0.0, 1.0])).as_quat()
    value = np.concatenate([np.zeros((30, 3)), turned[:, [3, 0, 1, 2]]], axis=1)
    stamps = BEGUN + np.round(time * 1e9).astype(np.int64)
    episode = Episode("e", "cell", "", {}, BEGUN, (Track("cube", "pose", stamps, value),), {})
    read, said = (dict(zip(of.input_names, one, strict=True)) for one in (of.inputs(episode), std(of, episode)))
    assert said["cube.wz"] == pytest.approx(abs(read["cube.wz"] - 1.0), abs=2e-3)

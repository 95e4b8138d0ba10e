"""Cells without code, against MuJoCo stepped by hand and against closed formulas."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from compass_ros.errors import ConfigError, DataError
from compass_ros.simulation import Simulator
from compass_ros.simulation.replay import recordings
from compass_ros.types import Episode, Floats, Track
from test.cells.written import DROP, PENDULUM, SERVO, TOSS, content, parameter, written

CUBE = {"name": "cube", "quantity": "pose"}
BALL = {"name": "ball", "quantity": "xyz"}
CART = {"name": "cart", "quantity": "xy"}
ARMS = [{"name": "joint1", "quantity": "joint"}, {"name": "joint2", "quantity": "joint"}]
TIME = np.arange(0.0, 0.5, 0.01)


def episode(initial: dict[str, tuple[float, ...]], *tracks: Track, action: dict[str, float] | None = None) -> Episode:
    return Episode("toss", "written", "", action or {}, 10**9, tracks, initial)


def track(name: str, quantity: str, time: Floats, value: Floats) -> Track:
    return Track(name, quantity, np.asarray(10**9 + np.round(time * 1e9), np.int64), value)  # type: ignore[arg-type]


def by_hand(scene: str, qpos: Floats, qvel: Floats, steps: int) -> Floats:
    """(steps + 1, nq) positions of plain mj_step."""
    model = mujoco.MjModel.from_xml_string(scene)
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = qpos, qvel
    out = [data.qpos.copy()]
    for _ in range(steps):
        mujoco.mj_step(model, data)
        out.append(data.qpos.copy())
    return np.array(out)


def test_a_toss_is_what_mujoco_steps_from_the_measured_state(tmp_path: Path) -> None:
    cell = written(tmp_path, TOSS, content([CUBE], start=[{"object": "cube"}]))
    spin = Rotation.from_euler("xyz", [0.3, -0.2, 0.1]).as_quat()[[3, 0, 1, 2]]
    state = (0.1, 0.2, 0.4, *spin, 0.5, -0.2, 0.1, 2.0, -3.0, 1.0)
    inputs = cell.inputs(episode({"cube": state}))
    seen = Simulator(cell, threads=1).observe(cell.defaults[None], inputs[None], TIME[None])[0]
    expected = by_hand(TOSS, np.array(state[:7]), np.array(state[7:]), 490)[::10]
    assert seen.shape == (50, 7)
    assert np.abs(seen - expected).max() < 1e-12
    assert seen[-1, 2] < 0.2, "it has fallen onto the table"


def test_bodies_inside_bodies_are_seen_where_their_sensors_are(tmp_path: Path) -> None:
    objects = [*ARMS, {"name": "tip", "quantity": "pose", "body": "arm2"}]
    cell = written(tmp_path, PENDULUM, content(objects, start=[{"object": "joint1"}, {"object": "joint2"}]))
    inputs = cell.inputs(episode({"joint1": (0.5, 1.0), "joint2": (-0.3, 2.0)}))
    seen = Simulator(cell, threads=1).observe(cell.defaults[None], inputs[None], TIME[None])[0]
    angles = by_hand(PENDULUM, np.array([0.5, -0.3]), np.array([1.0, 2.0]), 490)[::10]
    assert np.abs(seen[:, :2] - angles).max() < 1e-9
    elbow = np.stack([-0.17 * np.sin(angles[:, 0]), 0 * TIME, 1 - 0.17 * np.cos(angles[:, 0])], axis=1)
    assert np.abs(seen[:, 2:5] - elbow).max() < 1e-9
    half = 0.5 * angles.sum(axis=1)
    assert np.abs(seen[:, 5:] - np.stack([np.cos(half), 0 * half, np.sin(half), 0 * half], axis=1)).max() < 1e-9


def test_a_ball_on_a_rail_falls_as_galilei_says(tmp_path: Path) -> None:
    gravity = parameter("env@dyna@gravity", "opt.gravity[2]", default=-9.81)
    cell = written(tmp_path, DROP, content([BALL], [gravity], start=[{"object": "ball"}]))
    inputs = cell.inputs(episode({"ball": (0, 0, 12.0, 0, 0, -1.5)}))
    values = np.array([[-9.81], [-1.62]])
    seen = Simulator(cell, threads=1).observe(values, np.tile(inputs, (2, 1)), np.tile(TIME, (2, 1)))
    expected = 12 - 1.5 * TIME + 0.5 * values * TIME**2
    assert np.abs(seen[:, :, 2] - expected).max() < 3e-3  # half a time step times the speed
    assert np.all(seen[:, :, :2] == 0)


def test_an_unmeasured_start_is_taken_from_the_track_and_may_be_free(tmp_path: Path) -> None:
    start = {"object": "ball", "noise": {"position": 0.01, "velocity": 0.2}}
    cell = written(tmp_path, DROP, content([BALL], start=[start], release={"default_s": 0.1, "noise_s": 0.03}))
    time = np.arange(0, 0.5, 1 / 15)
    height = 10 - 2 * time - 0.5 * 9.81 * time**2
    fallen = track("ball", "xyz", time, np.stack([0 * time, 0 * time, height], axis=1))
    assert cell.input_names == ("ball.x", "ball.y", "ball.z", "ball.vx", "ball.vy", "ball.vz", "release")
    assert cell.launch_std.tolist() == [0.01, 0.01, 0.01, 0.2, 0.2, 0.2, 0.03]
    assert cell.inputs(episode({}, fallen)) == pytest.approx(
        [0, 0, 10, 0, 0, -2, 0.1], abs=1e-6
    )  # stamps are whole nanoseconds
    assert cell.inputs(episode({"ball": (0, 0, 11)}, fallen)) == pytest.approx(
        [0, 0, 11, 0, 0, -2, 0.1], abs=1e-6
    )  # stamps are whole nanoseconds


def test_before_the_release_everything_stands_still(tmp_path: Path) -> None:
    cell = written(tmp_path, DROP, content([BALL], start=[{"object": "ball"}], release={"noise_s": 0.05}))
    inputs = cell.inputs(episode({"ball": (0, 0, 2.0, 0, 0, 0)}))
    late, early = inputs.copy(), inputs.copy()
    late[-1], early[-1] = 0.2, -0.1
    seen = Simulator(cell, threads=1).observe(np.zeros((3, 0)), np.stack([inputs, late, early]), np.tile(TIME, (3, 1)))
    z = seen[:, :, 2]
    assert np.all(z[1, :20] == 2.0)
    assert np.abs(z[1, 20:] - z[0, :30]).max() < 1e-9
    assert np.abs(z[2, :40] - z[0, 10:]).max() < 1e-9


def test_a_pose_start_turns_by_a_small_vector_in_the_body(tmp_path: Path) -> None:
    cell = written(tmp_path, TOSS, content([CUBE], start=[{"object": "cube", "noise": {"orientation": 0.01}}]))
    spin = Rotation.from_euler("z", 0.5)
    inputs = cell.inputs(episode({"cube": (0, 0, 1, *(-spin.as_quat()[[3, 0, 1, 2]]), 0, 0, 0, 0, 0, 0)}))
    assert inputs[3] > 0, "the sign of a quaternion is chosen"
    inputs[13] = 0.1
    seen = Simulator(cell, threads=1).observe(np.zeros((1, 0)), inputs[None], np.zeros((1, 1)))[0, 0]
    expected = spin * Rotation.from_rotvec([0.1, 0, 0])
    assert seen[[4, 5, 6, 3]] == pytest.approx(expected.as_quat(), abs=1e-12)


def test_angular_velocity_of_a_track_is_in_the_frame_of_the_body(tmp_path: Path) -> None:
    cell = written(tmp_path, TOSS, content([CUBE], start=[{"object": "cube"}]))
    first, rate = Rotation.from_euler("xyz", [0.4, 0.2, -0.3]), np.array([1.0, -2.0, 0.5])
    time = np.arange(6) / 148
    turned = first * Rotation.from_rotvec(time[:, None] * rate)
    place = np.stack([time, 0 * time, 1 - 4.905 * time**2], axis=1)
    seen = track("cube", "pose", time, np.concatenate([place, turned.as_quat()[:, [3, 0, 1, 2]]], axis=1))
    inputs = cell.inputs(episode({}, seen))
    assert inputs[10:13] == pytest.approx(rate, abs=1e-6)  # stamps are whole nanoseconds
    assert inputs[7:10] == pytest.approx([1, 0, 0], abs=1e-6)  # stamps are whole nanoseconds


def test_quaternions_that_change_sign_on_the_way_are_one_rotation(tmp_path: Path) -> None:
    cell = written(tmp_path, TOSS, content([CUBE], start=[{"object": "cube"}]))
    time = np.arange(20) * 0.05
    turned = Rotation.from_rotvec(time[:, None] * np.array([6.0, 0, 0])).as_quat()[:, [3, 0, 1, 2]]
    signs = np.where(np.arange(20) % 3 == 1, -1.0, 1.0)[:, None]
    place = np.zeros((20, 3))
    data = recordings(cell, [episode({}, track("cube", "pose", time, np.hstack([place, signs * turned])))])
    assert np.abs(data.measured[0, :, 3:] - turned).max() < 1e-12


def test_commands_are_held_for_their_time_and_scaled(tmp_path: Path) -> None:
    share = parameter("motor@actuation@share", "command_scale", "motor", default=1.0)
    gain = parameter("motor@actuation@gain", "servo_gain", "motor", default=20.0)
    action = [
        {"name": "place", "unit": "m", "low": -1, "high": 1, "field": "qpos", "of": "rail"},
        {"name": "push", "unit": "m/s", "low": 0, "high": 2, "field": "qvel[0]", "of": "rail"},
        {
            "name": "speed",
            "unit": "m/s",
            "low": 0,
            "high": 2,
            "field": "ctrl",
            "of": "motor",
            "from_s": 0.1,
            "until_s": 0.4,
        },
    ]
    cell = written(tmp_path, SERVO, content([CART], [share, gain], action=action))
    values = np.array([[1.0, 200.0], [0.5, 200.0]])
    inputs = cell.inputs(episode({}, action={"place": 0.3, "push": 0.0, "speed": 1.0}))
    times = np.tile([0.0, 0.1, 0.25, 0.35, 0.45, 0.5], (2, 1))
    x = Simulator(cell, threads=1).observe(values, np.tile(inputs, (2, 1)), times)[:, :, 0]
    assert x[:, :2] == pytest.approx(np.full((2, 2), 0.3))
    assert (x[:, 3] - x[:, 2]) / 0.1 == pytest.approx([1.0, 0.5], rel=1e-3)
    assert x[:, 4] == pytest.approx(x[:, 5], abs=1e-4)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"objects": [{"name": "cub", "quantity": "pose"}]}, "no body 'cub'"),
        ({"objects": [{"name": "hinge", "quantity": "joint"}]}, "no joint 'hinge'"),
        ({"parameters": [parameter("a@b@c", "geom_frictoin[0]", "cube")]}, "did you mean 'geom_friction'"),
        ({"parameters": [parameter("a@b@c", "geom_friction[3]", "cube")]}, "3 numbers, found index 3"),
        ({"parameters": [parameter("a@b@c", "geom_friction[x]", "cube")]}, "expected NAME or NAME[INDEX]"),
        ({"parameters": [parameter("a@b@c", "geom_friction[0]", "cubes")]}, "did you mean 'cube'"),
        ({"parameters": [parameter("a@b@c", "contact_solref[1]", "cube")]}, "no contact pair"),
        ({"parameters": [parameter("a@b@c", "")]}, "say which field"),
        ({"parameters": [parameter("a@b@c", "table_load", "cube")]}, "no table_friction"),
        ({"parameters": [parameter("a@b@c", "observed_offset[7]", "cube")]}, "found index 7"),
        ({"start": [{"object": "cub"}]}, "did you mean 'cube'"),
        ({"start": [{"object": "cube", "noise": {"speed": 1}}]}, "start: cube: noise: speed: expected"),
        ({"action": [{"name": "a", "unit": "m", "low": 0, "high": 1}]}, "expected qpos[i], qvel[i] or ctrl"),
    ],
)  # fmt: skip
def test_mistakes_are_one_line_that_helps(tmp_path: Path, changes: dict[str, object], message: str) -> None:
    changed = content([CUBE]) | changes
    changed["factors"] = [o["name"] for o in changed["objects"]]  # type: ignore[attr-defined]
    with pytest.raises(ConfigError) as error:
        written(tmp_path, TOSS, changed)
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_a_scene_that_mujoco_refuses_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(ConfigError) as error:
        written(tmp_path, TOSS.replace('type="box"', 'type="boxx"'), content([CUBE]))
    assert "scene.xml" in str(error.value)
    assert "\n" not in str(error.value)


def test_a_body_that_cannot_start_where_it_was_seen_is_refused(tmp_path: Path) -> None:
    objects = [{"name": "arm1", "quantity": "xyz"}]
    with pytest.raises(ConfigError, match="free joint or slide joints"):
        written(tmp_path, PENDULUM, content(objects, start=[{"object": "arm1"}]))


def test_an_episode_without_a_start_is_refused(tmp_path: Path) -> None:
    cell = written(tmp_path, TOSS, content([CUBE], start=[{"object": "cube"}]))
    with pytest.raises(DataError, match="no initial state and no track of cube"):
        cell.inputs(episode({}))
    with pytest.raises(DataError, match="expected 7 or 13 numbers"):
        cell.inputs(episode({"cube": (1.0, 2.0)}))


def test_a_biased_encoder_measures_the_first_angle_with_its_bias(tmp_path: Path) -> None:
    bias = parameter("encoder@sensing@offset", "observed_offset[0]", "joint1", width=0.1)
    later = parameter("arm1@actuation@push", "start_qvel", "joint1", width=0.1)
    starts = [{"object": "joint1"}, {"object": "joint2"}]
    cell = written(tmp_path, PENDULUM, content(ARMS, [bias, later], start=starts))
    inputs = cell.inputs(episode({"joint1": (0.6, 0.0), "joint2": (0.0, 0.0)}))
    values = np.array([[0.1, 0.0], [0.0, 0.0], [0.0, 2.0]])
    seen = Simulator(cell, threads=1).observe(values, np.tile(inputs, (3, 1)), np.tile(TIME, (3, 1)))
    swing = by_hand(PENDULUM, np.array([0.5, 0.0]), np.zeros(2), 490)[::10]
    assert seen[0, 0, 0] == pytest.approx(0.6), "it starts where it was measured"
    assert np.abs(seen[0, :, 0] - 0.1 - swing[:, 0]).max() < 1e-9
    assert (seen[2, 1, 0] - seen[1, 1, 0]) / 0.01 == pytest.approx(2.0, rel=0.05)

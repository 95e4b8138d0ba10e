"""Long recordings are cut into windows that begin where they were measured."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from compass_ros.cells import Cell, load
from compass_ros.cells.drives import RUN_IN_S
from compass_ros.config import calibration_config
from compass_ros.errors import DataError
from compass_ros.operation.current import Current
from compass_ros.pipeline import calibrate
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import Attached, effect
from compass_ros.simulation.manifold import apart, charted, on_manifold
from compass_ros.simulation.replay import recordings
from compass_ros.simulation.windows import FEWEST, MOST, drive, near, usable, windows
from compass_ros.types import Episode, Floats, Track
from test.series.arms import CELL, PARAMETERS, START_NS, command, episode, recorded, write_cell


def smooth(seconds: float, rate_hz: float, noise: float, seed: int = 0) -> tuple[Floats, Floats, Floats]:
    """(n,) times, (n, 2) angles with noise, (n, 2) true rates."""
    time = np.arange(0, seconds, 1 / rate_hz)
    phase = 2 * np.pi * 0.7 * time[:, None] + np.array([0.0, 1.0])
    noisy = 0.5 * np.sin(phase) + np.random.default_rng(seed).normal(0, noise, (len(time), 2))
    return time, noisy, 0.5 * 2 * np.pi * 0.7 * np.cos(phase)


@pytest.mark.parametrize(("seconds", "count"), [(1.0, 1), (2.0, 1), (4.1, 2), (5.2, 3), (61.0, 31)])
def test_windows_part_a_recording(tmp_path: Path, seconds: float, count: int) -> None:
    cell = load(write_cell(tmp_path, CELL))
    time, angles, _ = smooth(seconds + 0.021, 50.0, 0.001)
    found = windows(cell, [episode("run", time, angles, angles)])
    assert len(found) == count
    stamps = np.concatenate([w.tracks[0].stamp_ns for w in found])
    assert len(np.unique(stamps)) == len(stamps)  # no frame is in two windows
    assert all(w.recording == "run" for w in found)
    starts = np.array([w.start_ns for w in found])
    assert np.all(np.diff(starts) == 2 * 10**9)


@pytest.mark.parametrize("rate_hz", [30.0, 50.0, 200.0, 1000.0])
def test_first_states_are_right_within_what_they_say(tmp_path: Path, rate_hz: float) -> None:
    """Normalised by what the window says of itself, errors are of standard size."""
    cell = load(write_cell(tmp_path, CELL))
    time, angles, rates = smooth(80.0, rate_hz, 0.001, seed=int(rate_hz))
    found = windows(cell, [episode("run", time, angles, angles)])
    off = []
    for w in found:
        at = round((w.start_ns - START_NS) * 1e-9 * rate_hz)
        state, std = np.array(w.initial_state["joints"]), np.array(w.initial_std["joints"])
        off.append((state[2:] - rates[at]) / std[2:])
    assert 0.6 < np.sqrt(np.mean(np.square(off))) < 1.6


def test_a_velocity_signal_says_the_first_rates(tmp_path: Path) -> None:
    more = "  - {name: rates, quantity: joint_velocity, of: [shoulder, elbow], noise: 0.01, fitted: false}\n"
    cell = load(write_cell(tmp_path, CELL + more))
    time, angles, rates = smooth(10.0, 50.0, 0.001)
    one = episode("run", time, angles, angles)
    one = replace(one, tracks=(*one.tracks, Track("rates", "joint_velocity", one.tracks[0].stamp_ns, rates + 3.0)))
    state = windows(cell, [one])[2].initial_state["joints"]
    assert np.abs(np.array(state[2:]) - rates[200] - 3.0).max() < 0.05


def test_a_fast_sensor_is_thinned_and_a_slow_one_is_not(tmp_path: Path) -> None:
    cell = load(write_cell(tmp_path, CELL))
    for rate_hz, frames in ((1000.0, 200), (150.0, 150), (100.0, 200), (30.0, 60)):
        time, angles, _ = smooth(4.1, rate_hz, 0.001)
        first = windows(cell, [episode("run", time, angles, angles)])[0]
        assert abs(len(first.tracks[0].stamp_ns) - frames) <= 1


def test_where_nothing_moves_there_is_no_window(tmp_path: Path) -> None:
    cell = load(write_cell(tmp_path, CELL))
    time, angles, _ = smooth(20.0, 50.0, 0.0)
    angles[200:600] = angles[200]
    angles += np.random.default_rng(1).normal(0, 0.001, angles.shape)
    found = windows(cell, [episode("run", time, angles, angles)])
    assert [round((w.start_ns - START_NS) * 1e-9) for w in found] == [0, 2, 12, 14, 16, 18]


def test_a_recording_without_motion_or_too_short_is_one_line(tmp_path: Path) -> None:
    cell = load(write_cell(tmp_path, CELL))
    time = np.arange(0, 10, 0.02)
    still = np.random.default_rng(0).normal(0, 0.001, (500, 2))
    with pytest.raises(DataError, match="nothing moves in its 5 windows"):
        windows(cell, [episode("run", time, still, still)])
    with pytest.raises(DataError, match=r"expected at least 1 s"):
        windows(cell, [episode("run", time[:40], still[:40], still[:40])])


DRIVEN = {
    # the YAML of the input, bounds of the elbow's delay, at which it is simulated, share of numbers that are not said
    "held": ("hold: zero", (0, 0.2), 0.0, 0.0),
    "at the longest delay": ("hold: zero", (0, 0.2), 0.2, 0.0),
    "ahead": ("hold: zero", (-0.3, 0.0), -0.3, 0.0),
    "linear": ("hold: linear", (0, 0.2), 0.13, 0.0),
    "one late by itself": ("hold: linear, delay_s: [0.4, 0.0]", (-0.1, 0.1), 0.05, 0.0),
    "rarely said": ("hold: zero", (0, 0.2), 0.1, 0.98),
}


@pytest.mark.parametrize("name", DRIVEN)
def test_a_window_has_what_drives_it_and_no_more(tmp_path: Path, name: str) -> None:
    """Simulated as with all of a recording's inputs, which alone would grow with the square of its length."""
    given, bounds, delay, lacking = DRIVEN[name]
    text = (CELL + PARAMETERS).replace("of: [shoulder, elbow]}", f"of: [shoulder, elbow], {given}}}", 1)
    cell = load(
        write_cell(tmp_path, text.replace("default: 0.0, bounds: [0, 0.2]", f"default: 0.0, bounds: {[*bounds]}"))
    )
    time, target = command(40.0, 4, 200.0)
    target[np.random.default_rng(1).random(target.shape) < lacking] = np.nan
    whole = episode("run", time, target, smooth(40.0, 200.0, 0.001)[1])
    found = windows(cell, [whole])
    most = (RUN_IN_S + cell.duration + bounds[1] - bounds[0] + 0.4) * 200 + 3
    assert max(len(w.inputs[0].stamp_ns) for w in found) <= most
    of_all = [replace(w, inputs=whole.inputs) for w in found]
    seen = []
    for own in (found, of_all):
        data = recordings(cell, own)
        simulator = Simulator(cell, threads=1).driven(data.drives)
        values = np.tile(cell.values({"elbow@actuation@delay": delay}), (len(own), 1))
        seen.append(simulator.observe(values, simulator.inputs(data.inputs), data.time_s))
    np.testing.assert_allclose(seen[0], seen[1], rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("law", "numbers"), [("first_order_lag", (0.1,)), ("rate_limit", (0.0, 0.01)), ("hysteresis", (0.05,))]
)
def test_a_drive_with_a_memory_knows_what_it_was_told_before_its_window(
    tmp_path: Path, law: str, numbers: tuple[float, ...]
) -> None:
    """As if it had followed the whole recording."""
    cell = load(write_cell(tmp_path))
    time, target = command(20.0, 4, 200.0)
    whole = episode("run", time, target, smooth(20.0, 200.0, 0.001)[1])
    data = recordings(cell, windows(cell, [whole]))
    simulator = Simulator(cell, threads=1).driven((drive(cell, whole), *data.drives))
    physics = simulator.with_effects([Attached(effect(law), ("shoulder",))]).physics
    inputs = simulator.inputs(data.inputs)
    values = np.tile(np.append(cell.values({}), numbers), (len(inputs), 1))
    steps = round(2.0 / simulator.time_step)
    inputs[:, -1] = 0
    at_once = physics.controls(values[:1], inputs[:1], len(inputs) * steps)
    inputs[:, -1] = 1 + np.arange(len(inputs))
    found = physics.controls(values, inputs, steps)
    assert at_once is not None
    assert found is not None
    apart = np.abs(found[..., 0] - at_once[0, :, 0].reshape(found.shape[:2])).max(axis=1)
    assert np.abs(found[..., 0] - np.roll(found[..., 0], 1, axis=0))[1:, 0].max() > 0.05
    assert apart.max() < 1e-3


@pytest.mark.parametrize(
    ("rate_hz", "lacking"), [(30, 0.0), (1000, 0.0), (1000, 0.9), (4000, 0.5), (50, 0.8), (5000, 0.999)]
)
def test_a_first_state_is_of_the_frames_around_it_in_however_long_a_recording(rate_hz: float, lacking: float) -> None:
    """As all frames of the recording say it."""
    rng = np.random.default_rng(int(rate_hz))
    stamps = START_NS + np.sort(rng.choice(10 * 10**9, round(10 * rate_hz), replace=False))
    value = rng.normal(size=(len(stamps), 2))
    value[rng.random(value.shape) < lacking] = np.nan
    track = Track("joints", "joint_position", stamps, value)
    for start_ns in (stamps[0], stamps[-1] + 10**9, *rng.choice(stamps, 5), START_NS + 10**9):
        seen = np.flatnonzero(~np.isnan(value[:, 1]))
        away = np.abs(stamps[seen] - start_ns)
        count = int(np.clip(np.sum(away <= 0.05 * 1e9), FEWEST, MOST))
        nearest = np.sort(seen[np.argsort(away, kind="stable")[:count]])
        assert near(track, int(start_ns), [1]).tolist() == nearest.tolist()


@pytest.mark.parametrize("lacks", ["motion", "length", "target", "one angle", "one target", "everything"])
def test_a_recording_without_windows_costs_the_others_nothing(tmp_path: Path, lacks: str) -> None:
    cell = load(write_cell(tmp_path))
    sound, bad = recorded(4.0, 1), recorded(4.0, 2)
    (joints,), (target,) = bad.tracks, bad.inputs
    lost = [replace(one, value=one.value * np.array([1.0, np.nan])) for one in (joints, target)]
    bad = {
        "motion": replace(bad, tracks=(replace(joints, value=0 * joints.value),)),
        "length": replace(bad, tracks=(replace(joints, stamp_ns=joints.stamp_ns[:30], value=joints.value[:30]),)),
        "target": replace(bad, inputs=()),
        "one angle": replace(bad, tracks=(lost[0],)),
        "one target": replace(bad, inputs=(lost[1],)),
        "everything": replace(bad, tracks=(), inputs=()),
    }[lacks]
    chosen, left_out = usable(cell, [sound, bad])
    assert [e.name for e in chosen] == ["run1"]
    assert [one.bag for one in left_out] == ["run2"]
    assert "\n" not in left_out[0].reason
    with pytest.raises(DataError):
        usable(cell, [bad])


def test_the_running_check_compares_windows_with_what_drove_them(tmp_path: Path) -> None:
    """The gap of a simulator in force, in a driven cell: small where it is right, large where it is not."""
    cell = load(write_cell(tmp_path))
    simulator = Simulator(cell, threads=1)
    truth = cell.values({"shoulder@dyna@damping": 0.8, "shoulder@actuation@gain": 80, "elbow@actuation@delay": 0.03})
    run = recorded(8.0, 3, delay_s=0.03)
    right, wrong = (Current(simulator, values).gap(run) for values in (truth, simulator.defaults))
    assert right < 0.2 * wrong
    assert Current(simulator, truth).residuals([run]).predicted.shape[0] == 4


def test_numbers_that_a_message_lacked_are_left_out_of_one_joint_alone(tmp_path: Path) -> None:
    cell = load(write_cell(tmp_path, CELL))
    time, angles, _ = smooth(4.1, 50.0, 0.001)
    partial = angles.copy()
    partial[::2, 0], partial[1::2, 1] = np.nan, np.nan
    data = recordings(cell, windows(cell, [episode("run", time, angles, partial)]))
    assert np.isnan(data.measured).mean() == pytest.approx(0.5, abs=0.02)
    assert not np.isnan(data.at_steps).any()


def cube(tmp_path: Path) -> Cell:
    text = "name: arm\ndynamics: mjcf\nmodel: arm.xml\nhorizon: 20\nobjects:\n  - {name: puck, quantity: pose}\n"
    return load(write_cell(tmp_path, text))


@pytest.mark.parametrize("seed", range(5))
def test_orientations_are_compared_on_their_manifold(tmp_path: Path, seed: int) -> None:
    cell, rng = cube(tmp_path), np.random.default_rng(seed)
    turn = rng.normal(0, 1, 3)
    turn *= rng.uniform(0.001, 3.0) / np.linalg.norm(turn)
    here = Rotation.random(random_state=seed)
    rows = [
        np.concatenate([[0, 0, 0], (here * Rotation.from_rotvec(v)).as_quat()[[3, 0, 1, 2]]]) for v in (0 * turn, turn)
    ]
    for sign in (1, -1):  # q and -q are one orientation
        moved = rows[1] * np.array([1, 1, 1, *[sign] * 4])
        difference = apart(cell, moved[None, None], charted(cell, rows[0][None, None]))[0, 0]
        assert np.abs(difference[3:6] - turn).max() < 1e-9
        assert np.isnan(difference[6])


def test_noise_of_an_orientation_is_that_of_a_rotation_vector(tmp_path: Path) -> None:
    cell, rng = cube(tmp_path), np.random.default_rng(0)
    here, vectors = Rotation.random(random_state=3), rng.normal(0, 0.01, (20000, 3))
    quaternions = (here * Rotation.from_rotvec(vectors)).as_quat()[:, [3, 0, 1, 2]]
    sigma = np.concatenate([[1, 1, 1], quaternions.std(axis=0)])
    assert on_manifold(cell, sigma)[3:6] == pytest.approx([0.01] * 3, rel=0.02)


def test_a_driven_arm_is_calibrated_to_the_noise(tmp_path: Path) -> None:
    """Three planted parameters, a delay among them; whole recordings are held out; gaps in radians by joint."""
    cell = load(write_cell(tmp_path))
    episodes: list[Episode] = [recorded(8.0, seed, delay_s=0.03) for seed in range(4)]
    result, _ = calibrate(episodes, cell, calibration_config({"discover": False, "threads": 1}))
    found = {row.name: row for row in result.parameters}
    for name, truth in (
        ("shoulder@dyna@damping", 0.8),
        ("shoulder@actuation@gain", 80),
        ("elbow@actuation@delay", 0.03),
    ):
        assert abs(found[name].value - truth) < 4 * found[name].std
        assert found[name].identifiable
    assert len(result.held_out) == 4  # the four windows of one recording
    gap = result.gap["calibrated"]["held_out"].signals["joints"]
    assert gap.unit == "rad"
    assert gap.rms == pytest.approx(0.001, rel=0.1)
    assert set(gap.parts) == {"shoulder", "elbow"}
    assert result.gap["nominal"]["held_out"].signals["joints"].rms > 0.005
    assert result.graph.factors == ("joints.shoulder", "joints.elbow")
    drawn = result.replays[0].tracks  # a pair of angles is no place in the plane
    assert [(track.object, track.real.shape[1]) for track in drawn] == [("joints.shoulder", 1), ("joints.elbow", 1)]

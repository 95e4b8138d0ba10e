"""Every kind of fault in every robot that can have it, of several sizes; and nothing in clean recordings of any."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from compass_ros.cells import load
from compass_ros.checks.check import Checked, check
from compass_ros.checks.frozen import frozen
from compass_ros.checks.interleaved import interleaved
from compass_ros.checks.series import Series, level
from compass_ros.checks.stamps import jumping_clock
from compass_ros.checks.wrapped import unwrapped
from compass_ros.episodes import read_episodes
from compass_ros.errors import DataError
from compass_ros.operation.current import sources
from compass_ros.types import Episode, Track
from test.checks import faults
from test.checks.faults import Fault
from test.checks.robots import PASSIVE, ROBOTS, cell, record
from test.real.conftest import REAL, needs_real

TURNING = ("pendulum", "rotor", "arm", "servo")
KINDS: dict[Fault, tuple[str, str, Sequence[str]]] = {
    faults.wrapped: ("wrapped", "repaired", TURNING),
    faults.zeros_of_another: ("zeros", "bad", tuple(ROBOTS)),
    faults.another_constant: ("constant", "bad", tuple(ROBOTS)),
    faults.another_place: ("two series", "bad", tuple(ROBOTS)),
    faults.sporadic_zeros: ("zeros", "bad", tuple(ROBOTS)),
    faults.frozen_for_a_while: ("frozen", "bad", tuple(ROBOTS)),
    faults.frozen_to_the_end: ("frozen", "bad", tuple(ROBOTS)),
    faults.held: ("held", "repaired", tuple(ROBOTS)),
    faults.clock_jumps: ("clock", "bad", tuple(ROBOTS)),
    faults.begins_late: ("late", "repaired", PASSIVE),
    faults.degrees: ("units", "bad", ("pendulum", "arm", "servo")),
    faults.millimetres: ("units", "bad", ("slider", "cube", "puck")),
}
"""What each fault is called, what comes of it, and which robots can have it."""
CASES = [(fault, robot, i % 5) for i, fault in enumerate(KINDS) for robot in KINDS[fault][2]]


def checked(robot: str, seed: int, folder: Path, episodes: Sequence[Episode]) -> Checked:
    return check(cell(robot, folder, seed), episodes)


@pytest.mark.parametrize(("fault", "robot", "seed"), CASES, ids=[f"{case[0].__name__}-{case[1]}" for case in CASES])
def test_each_fault_is_found_and_no_other(fault: Fault, robot: str, seed: int, tmp_path: Path) -> None:
    kind, severity, _ = KINDS[fault]
    spoilt = fault(record(robot, seed), np.random.default_rng(seed))
    found = checked(robot, seed, tmp_path, spoilt).findings
    assert {(one.kind, one.severity) for one in found} == {(kind, severity)}


SENSORS = (
    (60.0, 1.0, 0.0, 0),
    (60.0, 0.0, 0.0, 1),
    (60.0, 1.0, 0.0015, 2),
    (60.0, 0.0, 0.003, 3),
    (30.0, 2.0, 0.0, 4),
    (250.0, 0.3, 0.0, 5),
)


@pytest.mark.parametrize(("rate", "noise", "step", "seed"), SENSORS)
@pytest.mark.parametrize("robot", ROBOTS)
def test_nothing_is_found_in_clean_recordings(
    robot: str, rate: float, noise: float, step: float, seed: int, tmp_path: Path
) -> None:
    clean = record(robot, seed, rate=rate, noise=noise, step=step)
    found = checked(robot, seed, tmp_path, clean)
    assert [one.sentence for one in found.findings] == []
    assert found.left_out == ()
    assert all(before is after.tracks[0] for before, after in zip(_first(clean), found.episodes, strict=True))


def _first(episodes: Sequence[Episode]) -> list[Track]:
    return [e.tracks[0] for e in episodes]


@pytest.mark.parametrize(
    ("name", "bags"), [("air_hockey", "bags"), ("examples/own_cell/pendulum.yaml", "examples/own_cell/bags")]
)
def test_nothing_is_found_in_what_is_shipped(name: str, bags: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(Path(__file__).parents[2])
    known = load(name)
    assert check(known, read_episodes([bags], sources(known), known.name, known.hash)).findings == ()


def test_the_samples_that_are_wrong_are_said(tmp_path: Path) -> None:
    clean = record("slider")
    spoilt = faults.sporadic_zeros(clean, np.random.default_rng(0))
    (found,) = checked("slider", 0, tmp_path, spoilt).findings
    wrong = {
        new.name: tuple(np.flatnonzero((old.tracks[0].value != new.tracks[0].value)[:, 0]))
        for old, new in zip(clean, spoilt, strict=True)
    }
    assert dict(found.samples) == {name: which for name, which in wrong.items() if which}
    first = next(iter(found.samples.values()))
    assert f"01 (samples {first[0]}, {first[1]}, {first[2]}, ...)" in found.sentence


def test_wrong_recordings_are_left_out_where_enough_are_sound(tmp_path: Path) -> None:
    spoilt = faults.clock_jumps(record("cube"), np.random.default_rng(0))
    found = checked("cube", 0, tmp_path, spoilt)
    assert [one.bag for one in found.left_out] == ["01", "04"]
    assert len(found.episodes) == 6
    assert "the stamps jump" in found.sentence
    assert "from the other 6" in found.sentence


def test_where_all_are_wrong_all_are_used(tmp_path: Path) -> None:
    found = checked("arm", 0, tmp_path, faults.zeros_of_another(record("arm"), np.random.default_rng(0)))
    assert found.left_out == ()
    assert len(found.episodes) == 8
    assert found.bad


@pytest.mark.parametrize("robot", TURNING)
@pytest.mark.parametrize("seed", range(2))
def test_an_unwrapped_angle_is_the_angle(robot: str, seed: int, tmp_path: Path) -> None:
    """Up to whole turns of a recording, which a wrapped angle does not say."""
    clean = record(robot, seed)
    found = checked(robot, seed, tmp_path, faults.wrapped(clean, np.random.default_rng(seed)))
    for before, after in zip(clean, found.episodes, strict=True):
        apart = after.tracks[0].value - before.tracks[0].value
        assert np.ptp(apart) < 1e-9


@pytest.mark.parametrize("robot", PASSIVE)
@pytest.mark.parametrize("seed", range(2))
def test_time_0_is_where_the_motion_begins(robot: str, seed: int, tmp_path: Path) -> None:
    """To three samples, by which a slow start is seen early or late."""
    clean = record(robot, seed)
    late = faults.begins_late(clean, np.random.default_rng(seed))
    for given, after in zip(late, checked(robot, seed, tmp_path, late).episodes, strict=True):
        lead = len(given.tracks[0].stamp_ns) - len(clean[0].tracks[0].stamp_ns)
        released = given.tracks[0].stamp_ns[lead]
        assert abs(after.start_ns - released) * 1e-9 < 3.5 / 60


def still(robot: str) -> list[Episode]:
    """Recordings in which it stands, with the sensor's noise."""
    rng = np.random.default_rng(0)
    return [replace(e, tracks=tuple(_standing(track, rng) for track in e.tracks)) for e in record(robot)]


def _standing(track: Track, rng: np.random.Generator) -> Track:
    return replace(track, value=track.value[0] + 1e-3 * rng.normal(size=track.value.shape))


@pytest.mark.parametrize("robot", PASSIVE)
def test_recordings_without_a_motion_are_refused_in_one_line(robot: str, tmp_path: Path) -> None:
    with pytest.raises(DataError, match=r"^no recording holds a motion: .*nothing moves within 3 s of the start"):
        checked(robot, 0, tmp_path, still(robot))


@pytest.mark.parametrize("robot", PASSIVE)
def test_a_recording_without_a_motion_costs_the_others_nothing(robot: str, tmp_path: Path) -> None:
    moving = record(robot)
    found = checked(robot, 0, tmp_path, [*moving[:6], *still(robot)[6:]])
    assert [one.bag for one in found.left_out] == ["06", "07"]
    assert not found.bad
    assert any("nothing moves" in said for said in found.said)


def test_a_servo_that_never_moves_is_bad_data(tmp_path: Path) -> None:
    found = checked("servo", 0, tmp_path, still("servo"))
    assert [one.kind for one in found.bad] == ["still"]


@needs_real
@pytest.mark.slow
@pytest.mark.parametrize("expected", [1e-3, 2 * np.pi / 4096 / np.sqrt(12)])
@pytest.mark.parametrize("joint", range(5))
def test_real_servos_stick_and_slip_and_are_not_frozen(joint: int, expected: float) -> None:
    """36 motions of a hobby arm, 175 000 samples a joint; with a noise that is stated, and as its steps make it."""
    motions = np.load(REAL / "so101" / "motions.npz")
    series = [
        Series(name, "joint", "angle", motions[f"{name}.stamp_us"] * 1000, motions[f"{name}.position"][:, [joint]])
        for name in sorted({key.partition(".")[0] for key in motions.files})
    ]
    known = level(series, expected)
    found = (*unwrapped(series, known).findings, *interleaved(series, known), *frozen(series, known))
    assert (*found, *jumping_clock([replace(one, value=one.value / known.apart) for one in series])) == ()
    alone = [finding for one in series for finding in frozen([one], level([one], expected))]
    assert alone == [], "a joint that rests shows few values that change"

"""The numbers of `compass check`, against recordings that were made to have them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from compass_ros.checks.check import check
from compass_ros.checks.delay import Command, delay
from compass_ros.checks.figures import Figures, figures
from compass_ros.types import Episode, Floats
from test.checks.robots import ROBOTS, cell, changed, record

STEP_S = 0.01
TIME = STEP_S * np.arange(600)
RNG = np.random.default_rng(0)
COMMANDS: dict[str, Callable[[Floats], Floats]] = {
    "sine": lambda t: np.sin(3 * t),
    "chirp": lambda t: np.sin(2 * t + t**2),
    "steps": lambda t: np.random.default_rng(1).uniform(-1, 1, 12)[np.clip(2 * t + 1e-9, 0, 11).astype(int)],
    "ramps": lambda t: np.interp(t, [0, 1, 2, 4, 5], [0, 1, 1, -1, 0]),
    "sum of sines": lambda t: np.sin(2 * t) + 0.4 * np.cos(7 * t),
}


@pytest.mark.parametrize("late_s", [0.0, 0.04, 0.15, 0.39])
@pytest.mark.parametrize("kind", COMMANDS)
def test_a_delay_between_command_and_motion_is_found(kind: str, late_s: float) -> None:
    command = COMMANDS[kind](TIME)[:, None]
    follows = COMMANDS[kind](np.maximum(TIME - late_s, 0.0))[:, None]
    measured = 0.3 + 0.9 * follows + 0.002 * RNG.normal(size=follows.shape)
    assert delay(command, measured, STEP_S) == pytest.approx(late_s, abs=1.5 * STEP_S)


@pytest.mark.parametrize("late_s", [0.0, 0.1, 0.3])
@pytest.mark.parametrize("kind", ["chirp", "steps", "sum of sines", "ramps"])
def test_a_velocity_drive_is_followed_too(kind: str, late_s: float) -> None:
    command = COMMANDS[kind](TIME)[:, None]
    measured = np.cumsum(COMMANDS[kind](np.maximum(TIME - late_s, 0.0)))[:, None] * STEP_S
    assert delay(command, measured, STEP_S) == pytest.approx(late_s, abs=1.5 * STEP_S)


def test_what_follows_no_command_has_no_delay() -> None:
    command = COMMANDS["chirp"](TIME)[:, None]
    assert np.isnan(delay(command, RNG.normal(size=(600, 2)), STEP_S))
    assert np.isnan(delay(np.ones((600, 1)), COMMANDS["sine"](TIME)[:, None], STEP_S))


def test_a_command_holds_until_the_next() -> None:
    told = Command(np.array([0.0, 1.0]), np.array([[1.0], [2.0]]))
    np.testing.assert_array_equal(told.at(np.array([-1.0, 0.0, 0.99, 1.0, 5.0]))[:, 0], [1, 1, 1, 2, 2])


def of(robot: str, episodes: list[Episode], folder: Path) -> Figures:
    known = cell(robot, folder)
    return figures(known, check(known, episodes))[0]


@pytest.mark.parametrize("rate", [30.0, 60.0, 200.0])
@pytest.mark.parametrize("robot", ROBOTS)
def test_rate_noise_and_samples_are_those_that_were_recorded(robot: str, rate: float, tmp_path: Path) -> None:
    found = of(robot, record(robot, rate=rate), tmp_path)
    assert found.rate_hz == pytest.approx(rate, rel=1e-3)
    assert found.recordings == 8
    assert found.samples == 8 * len(np.arange(0, 3.2, 1 / rate))
    assert found.gaps == 0
    assert found.step == 0.0
    expected = 5e-4 if robot == "slider" else 1e-3
    assert expected / 1.3 < found.noise < expected * (1.3 if rate > 30 else 4)  # slow recordings hold more motion
    assert found.used == pytest.approx(3.0 / 3.2, abs=0.02)
    assert found.unit == ("m" if robot in ("slider", "cube", "puck") else "rad")


@pytest.mark.parametrize("step", [0.0015, 0.004, 0.02])
@pytest.mark.parametrize("robot", ["pendulum", "rotor", "slider", "arm", "servo"])
def test_the_step_of_an_encoder_is_said(robot: str, step: float, tmp_path: Path) -> None:
    assert of(robot, record(robot, step=step), tmp_path).step == pytest.approx(step, rel=1e-2)


@pytest.mark.parametrize("robot", ROBOTS)
def test_missing_frames_are_gaps(robot: str, tmp_path: Path) -> None:
    episodes = []
    for e in record(robot):
        keep = np.ones(len(e.tracks[0].stamp_ns), bool)
        keep[[50, 90, 91, 140]] = False
        tracks = tuple(replace(t, stamp_ns=t.stamp_ns[keep], value=t.value[keep]) for t in e.tracks)
        episodes.append(replace(e, tracks=tracks))
    assert of(robot, episodes, tmp_path).gaps == 8 * 3


def test_stillness_and_saturation_are_shares(tmp_path: Path) -> None:
    assert of("servo", record("servo"), tmp_path).still > 0.5  # it has arrived
    assert of("rotor", record("rotor"), tmp_path).still < 0.05
    clean = record("slider")
    largest = 0.5 * max(np.abs(e.tracks[0].value).max() for e in clean)
    clipped = [changed(e, value=np.clip(e.tracks[0].value, -largest, largest)) for e in clean]
    share = np.mean([np.abs(e.tracks[0].value) >= largest for e in clipped])
    assert of("slider", clean, tmp_path).saturated == 0.0
    assert of("slider", clipped, tmp_path).saturated == pytest.approx(share, abs=0.05)


@pytest.mark.parametrize("late_s", [0.05, 0.2, 0.6])
def test_the_delay_of_a_servo_that_is_told_one_goal_is_until_it_moves(late_s: float, tmp_path: Path) -> None:
    found = of("servo", [_held(e, round(late_s / 0.005)) for e in record("servo", rate=200.0)], tmp_path)
    assert late_s < found.delay_s < late_s + 0.06


def _held(e: Episode, samples: int) -> Episode:
    """The episode with its first value said so many times before it."""
    track = e.tracks[0]
    stamps = e.start_ns + 5_000_000 * np.arange(samples)
    noise = 1e-3 * np.random.default_rng(samples).normal(size=(samples, 1))
    return changed(
        e,
        stamp_ns=np.concatenate([stamps, track.stamp_ns + 5_000_000 * samples]),
        value=np.concatenate([track.value[0] + noise, track.value]),
    )

"""First states that were read off a track may be more wrong than its frames say: the episodes together show it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from compass_ros.calibration.cost import ROBUST, Point
from compass_ros.calibration.launches import relaunched
from compass_ros.calibration.least_squares import NONE, minimise
from compass_ros.calibration.noise import measure_noise
from compass_ros.calibration.refine import refine
from compass_ros.cells import Cell
from compass_ros.config import CalibrationConfig
from compass_ros.pipeline import calibrate
from compass_ros.posing import Posed
from compass_ros.simulation import Simulator
from compass_ros.simulation.replay import recordings
from compass_ros.types import Episode, Floats, Track
from test.calibration.toys import likelihood, oscillation
from test.cells.written import content, parameter, written

START, NOISE = 10**12, 1e-3
SCENE = """<mujoco><option timestep="0.002"/><worldbody><body><joint name="axis" type="slide" axis="1 0 0"
    stiffness="10" damping="{damping}"/><geom size="0.05" mass="0.1"/></body></worldbody></mujoco>"""
TIME = np.arange(0.0, 0.8, 1 / 30)
RATES = np.linspace(0.3, 0.55, 8)
FAST = 10.0
"""Damping with which these first rates [m/s] are gone after a frame, by when they have moved it by 10 ms of them."""


def cell(folder: Path, damping: float, noise: dict[str, float] | None = None) -> Cell:
    start: dict[str, object] = {"object": "axis", "frames": 6} | ({"noise": noise} if noise is not None else {})
    tuned = parameter("axis@dyna@stiffness", "jnt_stiffness", "axis", 10.0, 1.0)
    made = content([{"name": "axis", "quantity": "joint"}], [tuned], start=[start], noise_m=NOISE)
    return written(folder, SCENE.format(damping=damping), made)


def recorded(of: Cell, rates: Floats = RATES, seed: int = 0) -> list[Episode]:
    rng, simulator = np.random.default_rng(seed), Simulator(of, threads=1)
    first = np.stack([np.full(len(rates), 0.3), rates], axis=1)
    seen = simulator.observe(np.full((len(rates), 1), 10.5), first, np.tile(TIME, (len(rates), 1)))
    seen += NOISE * rng.normal(size=seen.shape)
    stamps = np.round(TIME * 1e9).astype(np.int64)
    return [
        Episode(f"e{i}", of.name, of.hash, {}, START + 10**11 * i,
                (Track("axis", "joint", START + 10**11 * i + stamps, one),))
        for i, one in enumerate(seen)
    ]  # fmt: skip


def posed(of: Cell, rates: Floats = RATES) -> Posed:
    data = recordings(of, recorded(of, rates))
    noise = measure_noise(data.time_s, data.measured, NOISE)
    return Posed(Simulator(of, threads=1), data, data, noise)


def wider(one: Posed) -> Posed | None:
    likelihood = one.problem.likelihood
    return one.wider(refine(likelihood, likelihood.prior_mean))


@pytest.mark.parametrize("damping", [0.05, 0.5])
def test_motion_that_the_frames_show_is_as_exact_as_they_say(damping: float, tmp_path: Path) -> None:
    assert wider(posed(cell(tmp_path, damping), RATES)) is None


@pytest.mark.parametrize("noise", [None, {"position": 0.001}])
def test_what_happens_between_frames_is_seen_by_all_episodes(tmp_path: Path, noise: dict[str, float] | None) -> None:
    one = posed(cell(tmp_path, FAST, noise))
    read = one.data.inputs[:, 1]
    error, found = float(np.sqrt(np.mean((read - RATES) ** 2))), wider(one)
    assert found is not None
    assert one.data.start_std[1] < 0.3 * error
    assert 0.6 * error < found.data.start_std[1] < 1.2 * error
    assert (found.judge.start_std == found.data.start_std).all()
    assert wider(found) is None


def test_what_the_cell_states_stands(tmp_path: Path) -> None:
    assert wider(posed(cell(tmp_path, FAST, {"position": 0.001, "velocity": 20.0}))) is None


def test_nothing_is_missing_there(tmp_path: Path) -> None:
    of = cell(tmp_path, FAST)
    assert calibrate(recorded(of), of, CalibrationConfig(threads=1))[0].mismatch.verdict == "none"


@pytest.mark.parametrize("windowed", [False, True])
def test_a_launch_in_a_side_minimum_is_found_anew_and_the_others_stay(windowed: bool) -> None:
    """Sines of six seconds with their frequency as the launch: two of four episodes begin beside it."""
    commanded, launched = np.full((4, 1), 1.0), np.array([[1.02], [0.97], [1.05], [0.99]])
    given = likelihood(oscillation, (0.0,), commanded, launched=launched, launch_std=0.1, noise=0.01, seconds=6.0)
    given = replace(given, windowed=windowed)
    aside = np.array([[0.02], [0.3], [0.05], [-0.25]])
    fit = minimise(given, Point(np.zeros(1), aside, np.inf), NONE, 20, ROBUST)
    assert np.abs(fit.point.launch - (launched - 1)).max() > 0.1
    found = relaunched(given, fit)
    assert found.launch == pytest.approx(launched - 1, abs=0.003)
    assert (found.launch[[0, 2]] == fit.point.launch[[0, 2]]).any()
    assert found.cost < fit.point.cost
    again = minimise(given, found, NONE, 1, ROBUST).point
    assert found.cost == pytest.approx(again.cost, abs=1.0)


@pytest.mark.parametrize("told", [RATES, 0.5 * RATES], ids=["right", "half"])
def test_first_states_that_are_not_what_was_stated_are_said(told: Floats, tmp_path: Path) -> None:
    of = cell(tmp_path, 0.05, {"position": 0.001, "velocity": 0.01})
    given = [
        replace(episode, initial_state={"axis": (0.3, float(rate))})
        for episode, rate in zip(recorded(of), told, strict=True)
    ]
    result, _ = calibrate(given, of, CalibrationConfig(discover=False, threads=1))
    said = [warning for warning in result.warnings if "the fit moved the first states by" in warning]
    assert len(said) == (told is not RATES)

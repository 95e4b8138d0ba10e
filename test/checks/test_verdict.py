"""What comes of a calibration from recordings with a fault: the truth where it can be mended, and else no physics."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
from _pytest.mark.structures import ParameterSet

from compass_ros.config import calibration_config
from compass_ros.pipeline import calibrate
from compass_ros.types import Episode, Result
from test.checks import faults
from test.checks.faults import Fault
from test.checks.robots import cell, changed, make, record

pytestmark = pytest.mark.slow
CONFIG = calibration_config({"discover": False, "threads": 1})


def _nightly(*cases: tuple[str, int]) -> list[ParameterSet]:
    return [pytest.param(*case, marks=pytest.mark.nightly) for case in cases]


def calibrated(robot: str, seed: int, episodes: list[Episode], folder: Path) -> Result:
    return calibrate(episodes, cell(robot, folder, seed), CONFIG)[0]


def true_damping(robot: str, seed: int) -> float:
    model = mujoco.MjModel.from_xml_string(make(robot, seed).scene)
    return float(model.dof_damping[-1])


@pytest.mark.parametrize(
    ("robot", "seed"),
    [("pendulum", 0), ("rotor", 0), *_nightly(("pendulum", 1), ("rotor", 1), ("rotor", 2))],
)
def test_wrapped_angles_give_what_plain_ones_give(robot: str, seed: int, tmp_path: Path) -> None:
    clean = record(robot, seed)
    wrapped = faults.wrapped(clean, np.random.default_rng(0)) if robot == "rotor" else _turned(clean)
    found = calibrated(robot, seed, wrapped, tmp_path)
    assert found.mismatch.verdict == "not_evaluated"
    assert any("wrapped" in said for said in found.warnings)
    assert found.parameters[0].value == pytest.approx(true_damping(robot, seed), rel=0.02)


def _turned(episodes: list[Episode]) -> list[Episode]:
    """The first joint reported in (-0.3, 2 pi - 0.3], as by an encoder whose zero is elsewhere."""
    out = []
    for e in episodes:
        value = e.tracks[0].value
        out.append(changed(e, value=(value + 0.3) % (2 * np.pi) - 0.3))
    return out


@pytest.mark.parametrize(
    ("robot", "seed"),
    [("pendulum", 0), ("slider", 0), *_nightly(("pendulum", 1), ("rotor", 0), ("slider", 1))],
)
def test_what_begins_late_gives_what_begins_in_time_gives(robot: str, seed: int, tmp_path: Path) -> None:
    found = calibrated(robot, seed, faults.begins_late(record(robot, seed), np.random.default_rng(0)), tmp_path)
    assert any("the motion begins" in said for said in found.warnings)
    assert found.parameters[0].value == pytest.approx(true_damping(robot, seed), rel=0.03)
    assert found.gap["calibrated"]["held_out"].rmse_m < 2 * found.noise_floor_m


BAD: tuple[tuple[Fault, str, bool], ...] = (
    (faults.clock_jumps, "pendulum", True),
    (faults.sporadic_zeros, "slider", True),
    (faults.frozen_for_a_while, "rotor", True),
    (faults.zeros_of_another, "pendulum", False),
    (faults.another_place, "slider", False),
)


@pytest.mark.parametrize(("fault", "robot", "few"), BAD, ids=[f"{f.__name__}-{robot}" for f, robot, _ in BAD])
def test_data_that_lie_are_data_bad_and_the_parameters_stay(
    fault: Fault, robot: str, few: bool, tmp_path: Path
) -> None:
    """Where `few` of the recordings lie, the others give the truth."""
    found = calibrated(robot, 0, fault(record(robot), np.random.default_rng(0)), tmp_path)
    assert found.mismatch.verdict == "data_bad"
    assert found.mismatch.sentence.startswith("The recordings are wrong: ")
    assert found.mismatch.effects == ()
    assert np.isfinite(found.noise_floor_m)
    assert found.noise_floor_m > 0
    assert bool(found.left_out) == few
    if few:
        assert found.parameters[0].value == pytest.approx(true_damping(robot, 0), rel=0.03)

"""A result is judged on recordings that it has not seen."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from compass_ros.cells import load
from compass_ros.cli import app
from compass_ros.config import calibration_config
from compass_ros.errors import ConfigError
from compass_ros.evaluation import evaluate, removed
from compass_ros.pipeline import calibrate
from compass_ros.results import write_all
from compass_ros.types import Gap, SignalGap
from test.series.arms import recorded, write_cell


@pytest.fixture(scope="module")
def result_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("evaluation")
    cell = load(write_cell(folder))
    episodes = [recorded(4.0, seed, delay_s=0.03) for seed in range(3)]
    result, found = calibrate(episodes, cell, calibration_config({"discover": False, "threads": 1}))
    write_all(result, found, cell, folder / "out")
    return folder


def test_other_recordings_of_the_same_arm_are_predicted_to_the_noise(result_folder: Path) -> None:
    cell = load(result_folder / "arm.yaml")
    said = evaluate(cell, result_folder / "out", [recorded(4.0, 77, delay_s=0.03)], threads=1)
    nominal, calibrated = (said.models[m].gap.signals["joints"] for m in ("nominal", "calibrated"))
    assert calibrated.rms == pytest.approx(0.001, rel=0.15)
    assert calibrated.rms < 0.2 * nominal.rms
    assert calibrated.unit == "rad"
    assert said.models["calibrated"].removed["joints"] > 0.97
    assert set(said.models) == {"nominal", "calibrated"}
    assert said.recordings == ("run77",)
    assert said.windows == 2


def test_another_arm_is_not(result_folder: Path) -> None:
    """What was fitted to one arm leaves a difference on one with dry friction, far above the floor."""
    cell = load(result_folder / "arm.yaml")
    said = evaluate(cell, result_folder / "out", [recorded(4.0, 78, delay_s=0.03, loss=4.0)], threads=1)
    gap = said.models["calibrated"].gap.signals["joints"]
    assert gap.rms > 3 * gap.floor


def test_the_cell_is_found_beside_the_result_or_named(result_folder: Path) -> None:
    content = json.loads((result_folder / "out" / "result.json").read_text())
    assert content["cell_file"] == "../arm.yaml"
    answer = CliRunner().invoke(app, ["evaluate", str(result_folder / "out"), str(result_folder / "no_bag")])
    assert "no_bag" in str(answer.exception)
    moved = result_folder / "elsewhere" / "deep"
    moved.mkdir(parents=True)
    (moved / "result.json").write_text(json.dumps(content))
    answer = CliRunner().invoke(app, ["evaluate", str(moved), "bag"])
    assert isinstance(answer.exception, ConfigError)
    assert "--cell" in str(answer.exception)


@pytest.mark.parametrize(
    ("rms", "share"), [(2.0, 1 - 3 / 99), (1.0, 1.0), (10.0, 0.0), (14.0, 1 - 195 / 99), (0.9, 1 + 0.19 / 99)]
)
def test_shares_are_of_the_excess_over_the_floor(rms: float, share: float) -> None:
    nominal = Gap({}, 10.0, {"a": SignalGap(10.0, "m", 1.0)})
    assert removed(nominal, Gap({}, rms, {"a": SignalGap(rms, "m", 1.0)}))["a"] == pytest.approx(share)


def test_no_share_where_the_nominal_simulator_is_at_the_noise() -> None:
    gap = Gap({}, 1.0, {"a": SignalGap(1.0, "m", 1.0)})
    assert np.isnan(removed(gap, replace(gap))["a"])

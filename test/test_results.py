"""What a calibration leaves on disk, and that it can be read, drawn and simulated again."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from compass_ros.cells import Cell, load
from compass_ros.config import CalibrationConfig
from compass_ros.discovery import Discovery
from compass_ros.episodes import read_episodes
from compass_ros.errors import ConfigError
from compass_ros.pipeline import calibrate
from compass_ros.reporting import write_report
from compass_ros.reporting.kept import RESULT, TRAJECTORIES, read_all
from compass_ros.results import EFFECTS, REPORT, SCENE, make_writable, write_all
from compass_ros.types import Result
from test.episodes.planted import PUCKS

BAGS = Path(__file__).parents[1] / "bags"
CONFIG = CalibrationConfig(method="random", rollouts=32, discover=False)


@pytest.fixture(scope="module")
def calibrated() -> tuple[Result, Discovery, Cell]:
    cell = load("air_hockey")
    return *calibrate(read_episodes([BAGS], PUCKS, cell.name, cell.hash), cell, CONFIG), cell


def test_everything_is_there_and_the_report_can_be_drawn_again(
    calibrated: tuple[Result, Discovery, Cell], tmp_path: Path
) -> None:
    result, found, cell = calibrated
    write_all(result, found, cell, tmp_path / "out", "compass calibrate ...", {"env@camera@bias_x": 0.03})
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == sorted(
        [EFFECTS, REPORT, RESULT, SCENE, TRAJECTORIES]
    )
    read, extras = read_all(tmp_path / "out")
    assert extras.command == "compass calibrate ..."
    assert [replay.episode for replay in read.replays] == [replay.episode for replay in result.replays]
    write_report(read, tmp_path / "again.html", extras)
    assert (tmp_path / "again.html").read_bytes() == (tmp_path / "out" / REPORT).read_bytes()


def test_the_scene_is_a_scene(calibrated: tuple[Result, Discovery, Cell], tmp_path: Path) -> None:
    result, found, cell = calibrated
    write_all(result, found, cell, tmp_path)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / SCENE))
    radius = next(row.value for row in result.parameters if row.name == "puck1@shape@radius")
    sizes = [model.geom(i).size[0] for i in range(model.ngeom)]
    assert np.isclose(sizes, radius, rtol=1e-6).any()


def test_a_folder_that_cannot_be_made_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(ConfigError, match="file: cannot be written"):
        make_writable(tmp_path / "file")

"""Versions of a cell's parameters: applied, taken back, and what the disk may do to them."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import pytest
import yaml

from compass_ros.cells import Cell, load
from compass_ros.errors import ConfigError
from compass_ros.operation.current import current
from compass_ros.operation.versions import Versions
from compass_ros.types import Verdict
from test.operation.results import write_calibration

FRICTION = "puck1@dyna@friction_sliding"


@pytest.fixture(scope="module")
def cell() -> Cell:
    return load("air_hockey")


@pytest.fixture
def versions(tmp_path: Path) -> Versions:
    return Versions(tmp_path / "versions", "air_hockey")


def test_apply_and_revert_go_through_the_versions_and_keep_them(cell: Cell, versions: Versions, tmp_path: Path) -> None:
    assert str(versions.applied()) == "version 0 (the cell as configured)"
    one = versions.apply(write_calibration(tmp_path / "one", cell, {FRICTION: 0.03}), {"bags": ["a", "b"]})
    two = versions.apply(write_calibration(tmp_path / "two", cell, {FRICTION: 0.08}), {"bags": ["c"]})
    assert (one.number, two.number, versions.applied().number) == (1, 2, 2)
    assert current(cell, two.folder).values[cell.index(FRICTION)] == 0.08
    assert yaml.safe_load((two.folder / "parameters.yaml").read_text())[FRICTION] == 0.08
    assert yaml.safe_load((two.folder / "origin.yaml").read_text()) == {"replaces": 1, "bags": ["c"]}

    assert versions.revert().number == 1
    assert versions.revert().number == 0
    with pytest.raises(ConfigError, match="nothing to revert: air_hockey runs with version 0"):
        versions.revert()
    three = versions.apply(tmp_path / "two", {})
    assert three.number == 3, "a number is never given twice"
    assert Versions(tmp_path / "versions", "air_hockey").applied() == three, "a process that starts later knows"
    assert sorted(path.name for path in versions.folder.iterdir()) == ["0001", "0002", "0003", "state.yaml"]


def test_a_version_is_simulated_with_its_own_numerics(cell: Cell, tmp_path: Path) -> None:
    other = replace(cell, time_step=0.0005, holds=True)
    assert current(cell, write_calibration(tmp_path / "one", other, {})).simulator.cell == other
    assert current(cell, write_calibration(tmp_path / "two", cell, {})).simulator.cell == cell


def test_what_the_scene_is_made_of_goes_with_it(cell: Cell, versions: Versions, tmp_path: Path) -> None:
    folder = write_calibration(tmp_path / "one", cell, {FRICTION: 0.03})
    (folder / "assets").mkdir()
    (folder / "assets" / "rod.obj").write_text("v 0 0 0")
    one = versions.apply(folder, {})
    shutil.rmtree(folder)
    assert (one.folder / "assets" / "rod.obj").read_text() == "v 0 0 0"


def test_a_value_at_its_bound_may_be_beyond_it_by_a_digit(cell: Cell, tmp_path: Path) -> None:
    folder = write_calibration(tmp_path / "one", cell, {FRICTION: 0.031234})
    high = cell.parameters[cell.index(FRICTION)].high
    path = folder / "result.json"
    text = path.read_text()
    path.write_text(text.replace('"value": 0.031234,', f'"value": {high * (1 + 1e-15)!r},'))
    assert current(cell, folder).values[cell.index(FRICTION)] == high
    path.write_text(text.replace('"value": 0.031234,', f'"value": {high * 1.01!r},'))
    with pytest.raises(ConfigError, match="is outside its bounds"):
        current(cell, folder)


@pytest.mark.parametrize("verdict", ["fit_failed", "data_bad"])
def test_parameters_that_mean_nothing_are_not_applied(
    cell: Cell, versions: Versions, tmp_path: Path, verdict: Verdict
) -> None:
    with pytest.raises(ConfigError, match=f"not applied: its verdict is '{verdict}'"):
        versions.apply(write_calibration(tmp_path / "bad", cell, {}, verdict), {})
    with pytest.raises(ConfigError, match="not applied: the calibration was cut short"):
        versions.apply(write_calibration(tmp_path / "cut", cell, {}, cancelled=True), {})
    assert versions.applied().number == 0
    assert not versions.folder.exists()


def test_another_cells_parameters_are_refused(cell: Cell, tmp_path: Path) -> None:
    result = write_calibration(tmp_path / "one", cell, {})
    with pytest.raises(ConfigError, match="parameters of 'air_hockey', this cell is 'push_i'"):
        Versions(tmp_path / "versions", "push_i").apply(result, {})
    with pytest.raises(ConfigError, match="parameters of 'air_hockey', this cell is 'push_i'"):
        current(load("push_i"), result)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("applied: [0, 7]", "names version 7, which is not in"),
        ("applied: [0, ../../etc]", "expected version numbers from 0 on"),
        ("applied: []", "expected version numbers"),
        ("applied: [1]", "expected version numbers"),
        ("- 1", "expected a mapping"),
    ],
)
def test_a_damaged_state_is_said(versions: Versions, text: str, message: str) -> None:
    versions.folder.mkdir(parents=True)
    (versions.folder / "state.yaml").write_text(text)
    with pytest.raises(ConfigError, match=message):
        versions.applied()


def test_a_folder_that_cannot_be_written(cell: Cell, tmp_path: Path) -> None:
    (tmp_path / "versions").write_text("")
    with pytest.raises(ConfigError, match="cannot be written"):
        Versions(tmp_path / "versions", "air_hockey").apply(write_calibration(tmp_path / "one", cell, {}), {})

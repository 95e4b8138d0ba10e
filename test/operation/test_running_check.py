"""The running check on bags: a table that changes is noticed, one that does not is left alone."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from compass_ros.cells import Cell, load
from compass_ros.errors import BagError, ConfigError
from compass_ros.operation.current import current, read
from compass_ros.operation.mismatch_map import mismatch_map
from compass_ros.operation.running_check import RunningCheck
from compass_ros.operation.versions import Versions
from test.nodes.recordings import NOISE_M, record
from test.operation.results import write_calibration

FRICTION = "puck1@dyna@friction_sliding"
TRUTH = {FRICTION: 0.1}


@pytest.fixture(scope="module")
def cell() -> Cell:
    return load("air_hockey")


@pytest.fixture(scope="module")
def before(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    return record(tmp_path_factory.mktemp("before"), TRUTH, shots=14, seed=1)


@pytest.fixture(scope="module")
def after(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """The table has been waxed."""
    return record(tmp_path_factory.mktemp("after"), {FRICTION: 0.03}, shots=12, seed=2)


@pytest.fixture
def versions(cell: Cell, tmp_path: Path) -> Versions:
    versions = Versions(tmp_path / "versions", cell.name)
    versions.apply(write_calibration(tmp_path / "result", cell, TRUTH), {})
    return versions


def test_the_gap_of_true_parameters_is_the_noise_and_of_wrong_ones_is_more(cell: Cell, before: list[Path]) -> None:
    episode = read(cell, before[0])
    right = current(cell)
    right.values[:] = cell.values(TRUTH)
    assert right.gap(episode) == pytest.approx(NOISE_M * np.sqrt(2), rel=0.1)
    assert current(cell).gap(episode) > 5 * NOISE_M


def test_a_change_is_noticed_and_nothing_before_it(
    cell: Cell, versions: Versions, before: list[Path], after: list[Path]
) -> None:
    check = RunningCheck(cell, versions, false_alarm=0.01)
    check.renew(before[:4])
    for bag in before[4:]:
        said = check.take(bag)
        assert not said.alarm
    assert said.sentence == "no sign that the gap has grown in 10 episodes"
    assert (said.version, check.take(before[4]).episodes) == (1, 10), "an episode counts once"
    for bag in after:
        if (said := check.take(bag)).alarm:
            break
    assert said.alarm
    assert said.sentence.endswith("please recalibrate")
    assert RunningCheck(cell, versions, false_alarm=0.01).verdict() == said, "as after a restart"

    versions.revert()
    assert check.renew().episodes == 0, "another version, another check"
    versions.apply(versions.folder / "0001", {})
    assert check.renew(after[:2]).episodes == 0


def test_bags_that_are_no_use(cell: Cell, versions: Versions, before: list[Path], tmp_path: Path) -> None:
    check = RunningCheck(cell, versions, false_alarm=0.01)
    gone = shutil.copytree(before[0], tmp_path / "gone")
    shutil.rmtree(gone)
    with pytest.raises(BagError, match="gone"):
        check.take(gone)
    assert check.renew([gone, before[1]]).episodes == 0
    assert check.verdict().sentence == "no episode yet"
    (versions.folder / "check_0001.yaml").write_text("reference: [x]\nepisodes: []\n")
    with pytest.raises(ConfigError, match=r"check_0001\.yaml: expected gaps"):
        RunningCheck(cell, versions, false_alarm=0.01)
    with pytest.raises(ConfigError, match="false_alarm: expected a probability"):
        RunningCheck(cell, versions, false_alarm=1.0)


def test_the_map_shows_where_recordings_and_simulator_differ(cell: Cell, before: list[Path]) -> None:
    residuals = current(cell).residuals([read(cell, bag) for bag in before[:3]])
    found = mismatch_map(residuals, size_m=0.03)
    rows, columns = found.mean_m.shape
    measured, predicted = residuals.paths("puck1")
    worst = np.nanargmax(np.linalg.norm(predicted - measured, axis=2))
    x, y = measured.reshape(-1, 2)[worst]
    column, row = (int((v - o) // 0.03) for v, o in zip((x, y), found.origin_m, strict=True))
    assert 0 <= column < columns
    assert 0 <= row < rows
    assert found.mean_m[row, column] > 3 * NOISE_M
    percent = found.percent(0.01)
    assert len(percent) == rows * columns
    assert {-1, 100} <= set(percent) <= set(range(-1, 101))
    start = int((-0.15 - found.origin_m[0]) // 0.03), int((0 - found.origin_m[1]) // 0.03)
    assert found.mean_m[start[1], start[0]] < found.mean_m[row, column], "at rest there is little to differ"


def test_an_episode_that_is_discarded_leaves_the_check(
    cell: Cell, versions: Versions, before: list[Path], after: list[Path]
) -> None:
    """As if it had never been: also after a restart, and one that was not counted changes nothing."""
    check, without = (RunningCheck(cell, v, 0.01) for v in (versions, Versions(versions.folder.parent, cell.name)))
    check.renew(before[:4])
    for bag in (before[4], after[0], before[5]):
        check.take(bag)
    dropped = check.drop(after[0])
    assert dropped == check.drop(after[1]) == RunningCheck(cell, versions, 0.01).verdict()
    path = versions.folder / "check_0001.yaml"
    path.unlink()
    without.renew(before[:4])
    without.take(before[4])
    assert without.take(before[5]) == dropped

"""trajectories.npz and back: the report that is drawn again is the report, byte for byte."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from compass_ros.errors import ConfigError
from compass_ros.reporting import ReportExtras, ResidualMap, write_report, write_result
from compass_ros.reporting.kept import RESULT, TRAJECTORIES, read_all, write_trajectories
from compass_ros.types import Iteration, Result, Verdict


def leave(result: Result, extras: ReportExtras, folder: Path) -> Path:
    write_trajectories(result, folder / TRAJECTORIES, extras)
    write_result(result, folder / RESULT)
    return folder


@pytest.mark.parametrize("verdict", ["named", "none"])
def test_the_report_drawn_again_is_the_same(
    make_result: Callable[[Verdict], Result], extras: ReportExtras, verdict: Verdict, tmp_path: Path
) -> None:
    grid = ResidualMap("push", "m/s^2", np.arange(3.0), np.arange(2.0), np.array([[1, np.nan, 2], [0.0, 4, 5]]))
    full = replace(extras, residual_before=grid, residual_after=grid)
    write_report(make_result(verdict), tmp_path / "first.html", full)
    write_report(*_swap(read_all(leave(make_result(verdict), full, tmp_path)), tmp_path / "again.html"))
    assert (tmp_path / "again.html").read_bytes() == (tmp_path / "first.html").read_bytes()


def _swap(read: tuple[Result, ReportExtras], path: Path) -> tuple[Result, Path, ReportExtras]:
    return read[0], path, read[1]


def test_it_is_small_beside_the_report(result: Result, extras: ReportExtras, tmp_path: Path) -> None:
    leave(result, extras, tmp_path)
    frames = sum(len(track.time_s) for replay in result.replays for track in replay.tracks)
    assert (tmp_path / TRAJECTORIES).stat().st_size < 80 * frames + 30_000


def test_methods_without_a_graph_and_results_without_anything(result: Result, tmp_path: Path) -> None:
    step = Iteration(np.array([1.0, np.nan]), np.empty(0), np.empty((0, 0)), 7)
    bare = replace(result, replays=(), trace=(step,))
    read, extras = read_all(leave(bare, ReportExtras(), tmp_path))
    assert read.replays == ()
    assert read.trace[0].psi.shape == (0, 0)
    assert read.trace[0].rollouts == 7
    np.testing.assert_array_equal(read.trace[0].values, step.values)
    assert extras == ReportExtras()


def test_what_is_missing_or_does_not_belong_is_one_line(result: Result, extras: ReportExtras, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"result\.json: cannot be read"):
        read_all(tmp_path)
    leave(result, extras, tmp_path)
    write_result(replace(result, seed=8), tmp_path / RESULT)
    with pytest.raises(ConfigError, match=r"trajectories\.npz: belongs to another result\.json"):
        read_all(tmp_path)
    (tmp_path / TRAJECTORIES).unlink()
    with pytest.raises(ConfigError, match=r"trajectories\.npz: no such file; calibrate again"):
        read_all(tmp_path)


def save(path: Path, **members: object) -> None:
    np.savez(path, **{name: np.array(value) for name, value in members.items()})


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (lambda path: path.write_bytes(path.read_bytes()[:500]), "cannot be read"),
        (lambda path: path.write_bytes(b""), "cannot be read"),
        (lambda path: path.write_text("trajectories of Monday"), "cannot be read"),
        (lambda path: save(path, about="{}"), "cannot be read"),
        (lambda path: save(path, about="{", numbers=[1.0]), "not a compass/trajectories/1"),
        (lambda path: save(path, about="{}", numbers=[1.0]), "not a compass/trajectories/1"),
        (lambda path: np.savez(path, about=np.array({"a": 1}, dtype=object), numbers=np.zeros(1)), "cannot be read"),
        (lambda path: save(path, about=str(np.load(path)["about"]), numbers=[1.0]), "damaged: an array of shape"),
        (lambda path: save(path, about=without(path, "truth"), numbers=np.load(path)["numbers"]), "damaged: 'truth'"),
    ],
)
def test_a_damaged_file_is_one_line(
    spoil: Callable[[Path], object], said: str, result: Result, extras: ReportExtras, tmp_path: Path
) -> None:
    path = leave(result, extras, tmp_path) / TRAJECTORIES
    spoil(path)
    with pytest.raises(ConfigError, match=said) as caught:
        read_all(tmp_path)
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)


def without(path: Path, field: str) -> str:
    content = json.loads(str(np.load(path)["about"]))
    del content[field]
    return json.dumps(content)

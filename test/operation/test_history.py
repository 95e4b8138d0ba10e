"""Weeks of one cell: what is planted is found, when it came, and chance finds as little as it says."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from compass_ros.operation.history import history
from compass_ros.operation.several import Number, Run, mean, read_runs
from compass_ros.operation.sheets import history_sheet
from compass_ros.reporting.sheet import write_sheet
from compass_ros.types import Gap
from test.conftest import Run as Command
from test.operation.many_results import WITH_PLAY, drawn, result, weeks, write


def runs_of(values: dict[str, list[float]], names: list[str] | None = None) -> list[Run]:
    count = len(next(iter(values.values())))
    labels = names or [f"w{i + 1}" for i in range(count)]
    return [Run(label, Path(label), result({n: v[i] for n, v in values.items()})) for i, label in enumerate(labels)]


def test_a_planted_step_is_found_in_its_week_and_play_is_said(tmp_path: Path) -> None:
    runs, left_out = read_runs(weeks(tmp_path))
    found = history(runs)
    assert left_out == ()
    (step,) = [move for move in found.moves if move.name == "elbow@dyna@damping"]
    assert (step.kind, step.before, step.after) == ("step", "2026-w04", "2026-w05")
    assert step.now.value - step.was.value == pytest.approx(0.3, abs=0.07)
    assert "moved between 2026-w04 and 2026-w05" in step.sentence
    assert found.notes == (
        "2026-w07: the most probable explanation is no longer 'nothing is missing' but 'backlash on elbow'",
    )
    assert set(found.table["backlash on elbow: width"]) == {"2026-w07", "2026-w08"}


def test_runs_far_above_their_floor_are_named() -> None:
    good, bad = runs_of({"hand@dyna@mass": [0.3, 0.4]})
    missed = Gap({"elbow": 0.1}, 0.034)
    bad = replace(
        bad, result=replace(bad.result, gap={"nominal": bad.result.gap["nominal"], "calibrated": {"held_out": missed}})
    )
    (note,) = history([good, bad]).notes
    assert note.startswith("w2: far above the noise floor")


def test_a_slow_drift_without_a_step_is_found() -> None:
    """Each week half an error bar more: no week differs from the mean of those before by three."""
    found = history(runs_of({"hand@dyna@mass": [0.3 + 0.006 * week for week in range(8)]}))
    (move,) = found.moves
    assert (move.kind, move.before, move.after) == ("drift", "w1", "w8")
    assert (move.was.value, move.now.value) == pytest.approx((0.3, 0.342))


def test_the_error_of_a_step_is_that_of_both_ends() -> None:
    """By hand: 4 weeks with 0.02 leave 0.01 in their mean; beside 0.02 that is 0.0224."""
    (move,) = history(runs_of({"shoulder@dyna@damping": [0.6, 0.6, 0.6, 0.6, 0.7]})).moves
    assert move.error_bars == pytest.approx(0.1 / np.hypot(0.01, 0.02))
    both = mean([Number(1.0, 1.0, ""), Number(4.0, 2.0, "")])
    assert (both.value, both.std) == pytest.approx((1.6, 0.8**0.5))


def test_where_nothing_changes_chance_finds_what_three_error_bars_say() -> None:
    """150 times eight weeks: 0.27 % of the comparisons, if error bars are true."""
    found, comparisons = 0, 0
    for seed in range(150):
        rng = np.random.default_rng(seed)
        one = history([Run(f"w{i}", Path(), result(drawn(rng))) for i in range(8)])
        found, comparisons = found + len(one.moves), comparisons + one.comparisons
    assert 0.001 < found / comparisons < 0.006, comparisons


def test_what_a_run_does_not_tell_is_left_out_there() -> None:
    values = {"elbow@dyna@damping": 0.8, "hand@dyna@mass": 0.3}
    said = [result(values), result({**values, "hand@dyna@mass": 4.0}, weak=["hand@dyna@mass"]), result(values)]
    found = history([Run(f"w{i}", Path(), one) for i, one in enumerate(said)])
    assert set(found.table["hand@dyna@mass"]) == {"w0", "w2"}
    assert found.moves == ()


def test_runs_that_mean_nothing_are_left_out_and_said(tmp_path: Path) -> None:
    values = {"elbow@dyna@damping": 0.8}
    planted = {"a": result(values), "b": result({"elbow@dyna@damping": 3.0}, verdict="fit_failed"),
               "c": result(values, cancelled=True), "d": result(values)}  # fmt: skip
    write(tmp_path, planted)
    runs, left_out = read_runs([tmp_path])
    assert [run.label for run in runs] == ["a", "d"]
    assert left_out == ("b was left out: its verdict is 'fit_failed'", "c was left out: it was cut short")


def test_the_command_says_the_same_in_words_json_and_page(tmp_path: Path, run: Command) -> None:
    folders = weeks(tmp_path / "weeks")
    status, out, err = run("history", *folders, "--out", tmp_path / "history.html")
    assert (status, err) == (0, "")
    text = " ".join(out.split())
    assert "elbow@dyna@damping moved between 2026-w04 and 2026-w05" in text
    status, out, _ = run("history", tmp_path / "weeks", "--json")
    said = json.loads(out)
    assert status == 0
    assert said["schema"] == "compass/history/1"
    assert [one["name"] for one in said["runs"]] == [folder.name for folder in folders]
    assert said["numbers"]["elbow@dyna@damping"]["2026-w05"]["std"] == 0.03
    page = (tmp_path / "history.html").read_text()
    assert all(move["sentence"].split(":")[0] in page for move in said["moves"])
    assert "http" not in page.split("<script>")[0].replace("http-equiv", "")


def test_names_of_a_result_stay_text_in_the_page(tmp_path: Path) -> None:
    hostile = "</script><script>alert(1)</script>@x@y"
    runs = [
        Run(f"<b>{i}", Path(), result({"elbow@dyna@damping": v}, WITH_PLAY, cell=hostile))
        for i, v in enumerate((1.0, 9.0))
    ]
    write_sheet(history_sheet(history(runs), ()), tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text()
    assert "<script>alert" not in page
    assert "<b>0" not in page


def test_bad_input_is_one_line(tmp_path: Path, run: Command) -> None:
    first, second = weeks(tmp_path)[:2]
    other = write(tmp_path / "other", {"a": result({"elbow@dyna@damping": 1.0}, cell="leg")})[0]
    (tmp_path / "empty").mkdir()
    broken = tmp_path / "broken"
    broken.mkdir()
    (broken / "result.json").write_text('{"schema": "compass/result/2"')
    for folders, said in (
        ([first], "expected two usable results or more, found 1"),
        ([first, first], "named twice"),
        ([first, other], "a result of 'leg'"),
        ([tmp_path / "empty"], "found no result.json"),
        ([tmp_path / "nowhere"], "found no result.json"),
        ([first, broken], "not valid JSON"),
    ):
        status, out, err = run("history", *folders)
        assert (status, out, err.count("\n")) == (1, "", 1), err
        assert said in err
    assert run("history", first, second, "--out", "/proc/nowhere/page.html")[0] == 1

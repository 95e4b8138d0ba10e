"""Where recordings were cut into windows, the report says so, and begins with the worst of them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from compass_ros.cells import load
from compass_ros.reporting import ReportExtras
from compass_ros.reporting.checks import assess
from compass_ros.reporting.drawing import MAX_REPLAYS, figure_data
from compass_ros.reporting.extras import Scene
from compass_ros.reporting.gallery import error_over_time
from compass_ros.reporting.report import render
from compass_ros.reporting.view.gap import episodes
from compass_ros.reporting.windows import began, by_recording, counted, in_windows, word
from compass_ros.simulation.windows import windows
from compass_ros.types import Result
from test.reporting.arm import NAMES, arm
from test.reporting.test_diagnosis import printed
from test.reporting.test_report import Outline
from test.series.arms import CELL, episode, write_cell


def test_windows_are_known_by_the_names_that_cutting_gives(result: Result, tmp_path: Path) -> None:
    time = np.arange(0, 6.1, 0.02)
    angles = np.sin(3 * time)[:, None] * np.array([1.0, 0.5])
    cut = windows(load(write_cell(tmp_path, CELL)), [episode("run at noon", time, angles, angles)])
    names = tuple(window.name for window in cut)
    assert in_windows(replace(result, fit=names[:1], held_out=names[1:]))
    assert by_recording(names) == [("run at noon", "at 0.0, 2.0, 4.0 s")]


def test_one_whole_recording_and_they_are_episodes(result: Result) -> None:
    assert word(result) == "episode"
    assert word(replace(result, fit=(*NAMES, "run"))) == "episode"
    assert word(replace(result, fit=(), held_out=())) == "episode"


def test_the_order_of_starts_is_that_of_numbers() -> None:
    assert by_recording(["a at 15.0 s", "b", "a at 5.0 s"]) == [("a", "at 5.0, 15.0 s"), ("b", "")]


@pytest.mark.parametrize(("count", "said"), [(0, "0 windows"), (1, "1 window"), (2, "2 windows")])
def test_counts_are_said(count: int, said: str) -> None:
    assert counted(count, "window") == said


def test_time_is_since_a_command_only_where_one_was_given(result: Result, extras: ReportExtras) -> None:
    assert began(result, extras.scene) == "the command"
    assert began(result, Scene()) == began(result, None) == "the episode began"
    assert began(arm(result), extras.scene) == "the window began"
    assert figure_data(arm(result), ReportExtras())["began"] == "the window began"


def test_the_report_of_windows_speaks_of_no_episodes(result: Result) -> None:
    of_arm = replace(arm(result), warnings=())
    page = Outline(render(of_arm, ReportExtras()))
    assert "2 fitted and 2 held-out windows" in page.said()
    assert "rms over windows that were never fitted" in page.said()
    said = [check.title + check.detail for check in assess(of_arm) if "Record more" not in check.detail]
    assert not [text for text in (*said, *page.text) if "episode" in text and "Record more" not in text]
    assert "of each window" in printed(of_arm, ReportExtras())


def test_names_are_folded_by_recording(result: Result) -> None:
    page = Outline(render(arm(result), ReportExtras()))
    assert "2 fitted windows of 1 recording ramp at 5.0, 15.0 s" in page.said()
    assert "2 held-out windows of 1 recording sweep at 0.0, 5.0 s" in page.said()
    assert [attributes for tag, attributes in page.tags if tag == "details" and attributes.get("class") == "names"]
    plain = Outline(render(result, ReportExtras())).said()
    assert f"{len(result.fit)} fitted episodes {' '.join(result.fit)}" in plain


def test_the_worst_held_out_window_is_first(result: Result) -> None:
    drawn = [one["name"] for one in figure_data(arm(result), ReportExtras())["episodes"]]
    assert drawn == ["sweep at 5.0 s", "sweep at 0.0 s", "ramp at 5.0 s", "ramp at 15.0 s"]
    listed = episodes(arm(result))
    assert [one["name"] for one in listed["rows"]] == drawn
    assert [(one["recording"], one["note"]) for one in listed["rows"][1:3]] == [
        ("sweep", "at 0.0 s, held out"),
        ("ramp", "at 5.0 s"),
    ]
    assert "Held-out windows first" in listed["order"]
    assert "largest error (calibrated, rms) on top" in listed["order"]


def test_a_window_in_which_the_simulator_lost_everything_is_the_worst(result: Result) -> None:
    good, *others = (one for one in arm(result).replays if one.held_out)
    lost = replace(good, tracks=tuple(replace(t, calibrated=np.full_like(t.real, np.nan)) for t in good.tracks))
    listed = episodes(replace(arm(result), replays=(*others, lost)))["rows"]
    assert listed[0]["name"] == lost.episode
    assert listed[0]["text"] == "\N{EN DASH}"


def test_which_windows_are_not_drawn_is_said(result: Result) -> None:
    unseen, fitted, *_ = arm(result).replays
    small, large = (replace(fitted, episode=f"{name} at 0.0 s") for name in ("small", "large"))
    small = replace(small, tracks=tuple(replace(t, calibrated=t.real) for t in small.tracks))
    few = replace(arm(result), replays=(small, *(unseen,) * (MAX_REPLAYS - 1), large))
    listed = episodes(few)
    assert listed["rows"][-1]["recording"] == "large"
    assert listed["not_drawn"] == "1 further window is not drawn: fitted, with the smallest error."
    many = episodes(replace(few, replays=(*few.replays, unseen, unseen)))["not_drawn"]
    assert many == "3 further windows are not drawn: those fitted, and 1 held out, with the smallest errors."
    assert episodes(arm(result))["not_drawn"] == ""


def test_a_still_figure_counts_time_from_the_beginning_of_a_window(result: Result, extras: ReportExtras) -> None:
    assert error_over_time(arm(result)).get_supxlabel() == "time since the window began [s]"
    assert error_over_time(result, extras.scene).get_supxlabel() == "time since the command [s]"

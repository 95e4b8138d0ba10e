"""The diagnosis in a terminal and its figures: planted differences appear where and when they are."""

from __future__ import annotations

import io
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from rich.console import Console

from compass_ros.reporting import ReportExtras, ResidualMap
from compass_ros.reporting.diagnosis import BARS, SHADES, print_diagnosis
from compass_ros.reporting.extras import Candidate
from compass_ros.reporting.gallery import worst_replay, write_figures
from compass_ros.reporting.residuals import error_curves
from compass_ros.reporting.view.missing import ranking
from compass_ros.types import Replay, ReplayedTrack, Result, Verdict


def printed(result: Result, extras: ReportExtras) -> str:
    console = Console(file=io.StringIO(), width=140, color_system=None)
    print_diagnosis(result, extras, console)
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


def test_candidates_that_read_alike_are_one_line(result: Result) -> None:
    alike = [Candidate("magnet", "dynamics", gain, 0.0, False, "within the noise") for gain in (5.0, 9.0)]
    other = Candidate("table_tilt", "dynamics", 7.0, 0.0, False, "within the noise")
    rows = ranking(result, (*alike, other))
    assert [(row["name"], row["evidence"]) for row in rows] == [("magnet", "9"), ("table_tilt", "7")]


def late(episode: str, held_out: bool, error_m: float) -> Replay:
    """A straight path from x = -0.2 to 0.2 m; the calibrated simulator is wrong in the second half alone."""
    time = np.linspace(0, 2, 200, endpoint=False)
    real = np.column_stack([-0.2 + 0.2 * time, np.zeros(200)])
    wrong = real + np.array([0.0, error_m]) * (time >= 1)[:, None]
    return Replay(episode, held_out, (ReplayedTrack("puck1", time, real, real + 0.1, wrong, None),))


def test_errors_are_shown_when_they_are(result: Result) -> None:
    planted = replace(result, replays=(late("a", False, 9.9), late("b", True, 0.004), late("c", True, 0.003)))
    nominal, calibrated = error_curves(planted, bins=20)
    assert (nominal.model, calibrated.model) == ("nominal", "calibrated")
    np.testing.assert_allclose(nominal.rms_m, 0.1 * np.sqrt(2))
    np.testing.assert_allclose(calibrated.rms_m[:10], 0, atol=1e-12)
    np.testing.assert_allclose(calibrated.rms_m[10:], np.sqrt((0.004**2 + 0.003**2) / 2))
    found = worst_replay(replace(planted, gap={k: v for k, v in planted.gap.items() if k != "with_effects"}))
    assert found is not None
    assert found.episode == "b"
    text = printed(planted, ReportExtras())
    (line,) = (row for row in text.splitlines() if row.startswith("  puck1") and "calibrated" in row)
    drawn = line.split()[-1]
    assert set(drawn[:20]) == {BARS[0]}
    assert BARS[0] not in drawn[20:]


def test_a_map_is_drawn_the_right_way_up(result: Result) -> None:
    value = np.full((4, 6), np.nan)
    value[3, 5] = 2.0  # largest y, largest x: top right
    value[0, 0] = 0.0
    grid = ResidualMap("push", "m/s^2", np.arange(6) * 0.02, np.arange(4) * 0.02, value)
    rows = printed(result, ReportExtras(residual_before=grid)).splitlines()
    start = next(i for i, row in enumerate(rows) if "seen from above" in row)
    assert rows[start + 1] == "  " + 5 * " " + SHADES[-1]
    assert rows[start + 2] == "  " + SHADES[0]


@pytest.mark.parametrize("verdict", get_args(Verdict))
def test_every_verdict_is_explained(make_result: Callable[[Verdict], Result], verdict: Verdict) -> None:
    result = make_result(verdict)
    text = " ".join(printed(result, ReportExtras()).split())
    assert result.mismatch.sentence in text
    assert result.mismatch.next_experiment in text
    for effect in result.mismatch.effects:
        assert all(twin in text for twin in effect.equivalents)


def test_a_result_without_anything_is_explained_and_drawn(result: Result, tmp_path: Path) -> None:
    graph = replace(result.graph, psi=np.zeros_like(result.graph.psi))
    rows = tuple(replace(row, active=False) for row in result.parameters)
    bare = replace(result, replays=(), trace=(), graph=graph, parameters=rows, noise_floor_m=float("nan"))
    assert "gap" in {path.stem for path in write_figures(bare, ReportExtras(), tmp_path)}
    assert result.mismatch.sentence in " ".join(printed(bare, ReportExtras()).split())


def test_names_in_a_result_are_no_markup_and_no_path(result: Result, tmp_path: Path) -> None:
    bad = replace(late("../[red]x", True, 0.01), episode="../[red]x")
    hostile = replace(result, replays=(bad,), mismatch=replace(result.mismatch, sentence="[bold]/etc[/bold]"))
    assert "[bold]/etc[/bold]" in printed(hostile, ReportExtras())
    written = write_figures(hostile, ReportExtras(), tmp_path)
    assert sorted(written) == sorted(tmp_path.iterdir())

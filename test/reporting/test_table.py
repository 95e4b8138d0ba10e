"""The terminal's table."""

from __future__ import annotations

import io
from collections.abc import Callable
from dataclasses import replace
from typing import get_args

import pytest
from rich.console import Console

from compass_ros.reporting import ReportExtras, print_result
from compass_ros.types import Result, Verdict


def printed(result: Result, truth: dict[str, float] | None = None, width: int = 140) -> str:
    console = Console(file=io.StringIO(), width=width, color_system=None)
    print_result(result, truth, console)
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


def line(text: str, name: str) -> list[str]:
    """The cells of the first row that holds `name`."""
    found = next(row for row in text.splitlines() if name in row)
    return [cell.strip() for cell in found.split("│")]


def test_parameters_gap_and_verdict(result: Result, extras: ReportExtras) -> None:
    text = printed(result, dict(extras.truth))
    assert line(text, "pusher@actuation@vel_discount") == [
        "pusher@actuation@vel_discount", "0.75", "0.8463 ± 0.0031", "0.85", "",
    ]  # fmt: skip
    assert line(text, "calibrated")[1:] == ["19.6", "0.11", "19.40", "19.3"]
    assert "noise floor 1.01 mm" in text
    assert result.mismatch.sentence in " ".join(text.split())
    assert "54 further parameters" in text
    assert "held out [mm]" in text


def test_a_cell_of_hinges_has_its_errors_in_mrad(result: Result) -> None:
    text = printed(replace(result, unit="rad"))
    assert "noise floor 1.01 mrad" in text
    assert "held out [mrad]" in text
    assert "fitted [mrad]" in text


def test_eighty_columns_hold_every_name(result: Result, extras: ReportExtras) -> None:
    text = printed(result, dict(extras.truth), width=80)
    assert all(row.name in text for row in result.parameters if row.active)


def test_without_truth_there_is_no_column_for_it(result: Result) -> None:
    assert "truth" not in printed(result)


def test_a_wrong_parameter_that_was_missed_is_shown(result: Result) -> None:
    name = "table@dyna@friction_sliding"
    assert name not in printed(result)
    assert line(printed(result, {name: 0.08}), name)[2:4] == ["0.05 (no edge)", "0.08"]


@pytest.mark.parametrize("verdict", get_args(Verdict))
def test_every_verdict_prints(verdict: Verdict, make_result: Callable[[Verdict], Result]) -> None:
    result = make_result(verdict)
    assert result.mismatch.sentence in " ".join(printed(result, width=400).split())


def test_markup_in_names_has_no_effect(result: Result) -> None:
    rows = (replace(result.parameters[0], name="[red]puck[/red]", unit="[bold]"),)
    text = printed(replace(result, parameters=rows, warnings=("[link=x]w[/link]",)))
    assert "[red]puck[/red]" in text
    assert "[link=x]w[/link]" in text

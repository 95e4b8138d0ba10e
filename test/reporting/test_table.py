"""The terminal's table."""

from __future__ import annotations

import io
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import get_args

import pytest
from rich.console import Console

from compass_ros.reporting import ReportExtras, print_result
from compass_ros.types import Result, Together, Verdict


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


def sections(text: str) -> dict[str, list[str]]:
    """Names of the parameters under each heading."""
    found: dict[str, list[str]] = {}
    for row in text.splitlines():
        name, *cells = [cell.strip() for cell in row.split("│")]
        if len(cells) >= 3 and name and not any(cells):
            found[name] = []
        elif found and "@" in name and cells:
            list(found.values())[-1].append(name)
    return found


KINDS = {
    "wrong, with an edge": (4.0, True),
    "wrong, without an edge": (-13.0, False),
    "not moved, with an edge": (0.5, True),
    "": (2.9, False),
}
"""Error bars by which a parameter has moved, and whether it has an edge."""


def moved(result: Result, bars: Sequence[float], active: Sequence[bool], std: float) -> Result:
    """The same with parameters that have moved so far; all others have not, and have no edge."""
    rows = [replace(row, active=False, value=row.default, std=std) for row in result.parameters]
    for i, (far, edge) in enumerate(zip(bars, active, strict=True)):
        rows[i] = replace(rows[i], value=rows[i].default + far * std, active=edge)
    return replace(result, parameters=tuple(rows))


def test_what_was_wrong_is_shown_apart_from_what_matters(result: Result) -> None:
    kinds = [name for name in KINDS for _ in range(2)]
    bars, active = [KINDS[k][0] for k in kinds], [KINDS[k][1] for k in kinds]
    text = printed(moved(result, bars, active, 1e-3))
    for kind, names in sections(text).items():
        assert names == [result.parameters[i].name for i, own in enumerate(kinds) if own == kind]
    assert list(sections(text)) == [kind for kind in KINDS if kind]
    assert "58 further parameters have no edge and moved by less than 3 error bars" in " ".join(text.split())


@pytest.mark.parametrize("bars", [3.5, -3.5, 13.0, -200.0, 1e6])
def test_no_parameter_that_moved_far_is_among_those_that_are_not_shown(result: Result, bars: float) -> None:
    text = printed(moved(result, [bars], [False], 1e-4), width=80)
    assert sections(text) == {"wrong, without an edge": [result.parameters[0].name]}


def test_a_method_without_error_bars_says_nothing_of_them(result: Result) -> None:
    text = printed(moved(result, [1.0, 1.0], [True, False], math.nan))
    assert sections(text) == {}
    assert result.parameters[0].name in text
    said = " ".join(text.split())
    assert "63 further parameters have no edge simulator" in said, "and then comes the next table"


def test_what_shows_only_together_is_said(result: Result) -> None:
    text = " ".join(printed(replace(result, together=(Together(("m", "d", "f"), ratios=True),))).split())
    assert "3 parameters told only together. m : d : f show only as ratios." in text


@pytest.mark.parametrize("verdict", get_args(Verdict))
def test_every_verdict_prints(verdict: Verdict, make_result: Callable[[Verdict], Result]) -> None:
    result = make_result(verdict)
    assert result.mismatch.sentence in " ".join(printed(result, width=400).split())


def test_markup_in_names_has_no_effect(result: Result) -> None:
    rows = (replace(result.parameters[0], name="[red]puck[/red]", unit="[bold]"),)
    text = printed(replace(result, parameters=rows, warnings=("[link=x]w[/link]",)))
    assert "[red]puck[/red]" in text
    assert "[link=x]w[/link]" in text

"""`Is my result good?`: each fault of a result is found, and a good one passes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import get_args

import pytest

from compass_ros.reporting.checks import assess, overall
from compass_ros.types import Gap, LeftOut, Result, Together, Verdict


def titles(result: Result, *levels: str) -> list[str]:
    return [check.title for check in assess(result) if check.level in levels]


def with_gap(result: Result, **errors: tuple[float, float]) -> Result:
    """Gap by model as (fit, held-out) rms in mm."""
    gap = {m: {"fit": Gap({}, f / 1e3), "held_out": Gap({}, h / 1e3)} for m, (f, h) in errors.items()}
    return replace(result, gap=gap, noise_floor_m=1e-3)  # type: ignore[arg-type]  # the keys are the literals


@pytest.fixture
def clean(make_result: Callable[[Verdict], Result]) -> Result:
    """Nothing to complain about."""
    result = make_result("none")
    rows = tuple(replace(row, identifiable=True) for row in result.parameters)
    return with_gap(replace(result, parameters=rows), nominal=(50.0, 51.0), calibrated=(1.0, 1.05))


def test_a_good_result_is_called_good(clean: Result) -> None:
    assert overall(assess(clean)) == "good"
    assert "At the noise floor" in titles(clean, "good")


@pytest.mark.parametrize(
    ("errors", "level", "title"),
    [
        ({"nominal": (50.0, 50.0), "calibrated": (1.0, 1.6)}, "care", "Above the noise floor"),
        ({"nominal": (50.0, 50.0), "calibrated": (5.0, 5.0)}, "bad", "Far above the noise floor"),
        ({"nominal": (3.0, 3.0), "calibrated": (2.0, 2.0)}, "care", "Little gained"),
        ({"nominal": (3.0, 3.0), "calibrated": (4.0, 4.0)}, "bad", "Worse than before"),
        ({"nominal": (50.0, 50.0), "calibrated": (1.0, 1.5)}, "care", "Does not carry over fully"),
    ],
)
def test_errors_that_are_too_large(
    clean: Result, errors: dict[str, tuple[float, float]], level: str, title: str
) -> None:
    result = with_gap(clean, **errors)
    assert title in titles(result, level)
    assert overall(assess(result)) != "good"


def test_a_simulator_that_was_right_already(clean: Result) -> None:
    result = with_gap(clean, nominal=(1.0, 1.0), calibrated=(1.0, 1.0))
    assert "The default simulator was already right" in titles(result, "good")


def test_the_best_model_is_judged(clean: Result) -> None:
    result = with_gap(clean, nominal=(50.0, 50.0), calibrated=(9.0, 9.0), with_effects=(1.0, 1.0))
    assert "At the noise floor" in titles(result, "good")


@pytest.mark.parametrize(("held_out", "warned"), [(1.4, False), (1.5, True)])
def test_an_effect_that_predicts_worse(clean: Result, held_out: float, warned: bool) -> None:
    result = with_gap(clean, nominal=(50.0, 50.0), calibrated=(1.4, 1.4), with_effects=(1.2, held_out))
    assert ("What was named does not predict better" in titles(result, "care")) == warned


def test_nothing_held_out(clean: Result) -> None:
    assert "Nothing held out" in titles(replace(clean, held_out=()), "bad")


def test_cancelled(clean: Result) -> None:
    assert "Stopped early" in titles(replace(clean, cancelled=True), "bad")


def test_a_value_at_its_bound_counts_only_where_it_is_active(clean: Result) -> None:
    active, inactive = clean.parameters[0], next(row for row in clean.parameters if not row.active)
    stuck = replace(active, value=active.bounds[1])
    assert "1 at a bound" in titles(replace(clean, parameters=(stuck,)), "care")
    absent = replace(active, value=0.0, bounds=(0.0, 1.0))
    found = [c for c in assess(replace(clean, parameters=(absent,))) if c.title == "1 at zero"]
    assert [c.level for c in found] == ["note"]
    idle = replace(inactive, value=inactive.bounds[0])
    assert titles(replace(clean, parameters=(idle,)), "care") == []


def test_not_identifiable_parameters_are_named(clean: Result) -> None:
    row = replace(clean.parameters[0], identifiable=False)
    found = [c for c in assess(replace(clean, parameters=(row, *clean.parameters[1:]))) if "identifiable" in c.title]
    assert found[0].level == "care"
    assert row.name in found[0].detail


@pytest.mark.parametrize("ratios", [True, False])
def test_what_shows_only_together_is_said(clean: Result, ratios: bool) -> None:
    group = Together(("arm@dyna@mass", "arm@dyna@damping"), ratios)
    found = [c for c in assess(replace(clean, together=(group,))) if "together" in c.title]
    assert [c.level for c in found] == ["care"]
    assert group.sentence in found[0].detail


@pytest.mark.parametrize("verdict", get_args(Verdict))
def test_no_verdict_is_a_pass_unless_something_was_concluded(verdict: Verdict, clean: Result) -> None:
    result = replace(clean, mismatch=replace(clean.mismatch, verdict=verdict))
    assert (overall(assess(result)) == "good") is (verdict in ("none", "named"))


def test_a_likely_false_alarm_needs_care(clean: Result, make_result: Callable[[Verdict], Result]) -> None:
    named = make_result("named").mismatch
    doubtful = replace(named.effects[0], evidence=replace(named.effects[0].evidence, false_alarm_p=0.2))
    assert overall(assess(replace(clean, mismatch=named))) == "good"
    assert overall(assess(replace(clean, mismatch=replace(named, effects=(doubtful,))))) == "care"


def test_recordings_left_out_for_one_reason_stand_together(clean: Result) -> None:
    why = "start: nothing moves"
    left = (LeftOut("w/a", why), LeftOut("w/b", why), LeftOut("w/c", "no clock"), LeftOut("x/d", why))
    notes = [(c.title, c.detail) for c in assess(replace(clean, left_out=left)) if "left out" in c.title.lower()]
    assert notes == [
        ("2 left out", "w/a, b: start: nothing moves"),
        ("Left out", "w/c: no clock"),
        ("Left out", "x/d: start: nothing moves"),
    ]

"""Numbers have the digits that their error bars justify."""

from __future__ import annotations

import pytest

from compass_ros.reporting.numbers import MINUS, MISSING, duration, plain, probability, thousandths, typeset, value_pm

NAN = float("nan")


@pytest.mark.parametrize(
    ("value", "std", "text"),
    [
        (0.041234, 0.00061, "0.04123 ± 0.00061"),
        (-6.1123, 0.24, f"{MINUS}6.11 ± 0.24"),
        (1234.5, 12.0, "1234 ± 12"),
        (0.5, NAN, "0.5"),
        (0.5, 0.0, "0.5"),
        (NAN, 0.1, MISSING),
        (1.5e-9, 2.0e-10, f"1.500e{MINUS}09 ± 2.0e{MINUS}10"),
    ],
)
def test_value_pm(value: float, std: float, text: str) -> None:
    assert value_pm(value, std) == text


@pytest.mark.parametrize(
    ("metres", "text"), [(0.183, "183"), (0.0196, "19.6"), (0.00104, "1.04"), (0.00043, "0.43"), (NAN, MISSING)]
)
def test_thousandths(metres: float, text: str) -> None:
    assert thousandths(metres) == text


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(3.21, "3.2 s"), (41.0, "41 s"), (187.4, "3 min 07 s"), (53600.0, "14 h 53 min"), (NAN, MISSING)],
)
def test_duration(seconds: float, text: str) -> None:
    assert duration(seconds) == text


def test_small_probabilities_are_bounds() -> None:
    assert probability(0.0004) == "< 0.001"
    assert probability(0.034) == "0.034"


def test_typeset() -> None:
    assert typeset("0.21 +- 0.01 m/s2, 5 -> 1 mm") == "0.21 ± 0.01 m/s², 5 → 1 mm"
    assert typeset("x -0.5 +- 3e-05 of 2026-11-29 to unit-3") == f"x {MINUS}0.5 ± 3e{MINUS}05 of 2026-11-29 to unit-3"


def test_plain_writes_thousands_out() -> None:
    assert [plain(x, 3) for x in (4794.0, -117.2, 4e3, 9.996e5)] == ["4790", f"{MINUS}117", "4000", "1e+06"]


def test_plain_has_a_true_minus() -> None:
    assert plain(-0.5) == f"{MINUS}0.5"

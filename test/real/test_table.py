"""Tables as they are read."""

from __future__ import annotations

import pytest

from compass_ros.errors import ConfigError
from compass_ros.real.studies import STUDIES, chosen
from compass_ros.real.table import Study, Table, with_error


@pytest.mark.parametrize(
    ("value", "std", "text"),
    [
        (0.57312, 0.0041, "0.5731 ± 0.0041"),
        (5.2, 2.6, "5.2 ± 2.6"),
        (31.0, 12.0, "31 ± 12"),
        (0.000188, 0.0000024, "(188.0 ± 2.4)e-6"),
    ],
)
def test_the_error_decides_the_digits(value: float, std: float, text: str) -> None:
    assert with_error(value, std) == text


def test_markdown() -> None:
    text = Study("balls", ("Air.",), (Table("T", ("a", "b"), (("1", "2"),)),)).markdown()
    assert text == "## balls\n\n- Air.\n\n### T\n\n| a | b |\n|---|---|\n| 1 | 2 |\n"


def test_a_study_that_is_not_known() -> None:
    with pytest.raises(ConfigError, match=r"unknown study 'ball_drop'; known: .*did you mean 'ball_drops'"):
        chosen(["ball_drop"])
    assert list(chosen([])) == list(STUDIES)

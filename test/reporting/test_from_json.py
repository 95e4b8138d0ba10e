"""result.json and back: what the file says is what the result said."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import get_args

import pytest

from compass_ros.reporting.from_json import from_json
from compass_ros.reporting.result_json import to_json
from compass_ros.types import Result, Together, Verdict


@pytest.mark.parametrize("verdict", get_args(Verdict))
def test_back_and_forth_is_the_same(make_result: Callable[[Verdict], Result], verdict: Verdict) -> None:
    content = to_json(make_result(verdict))
    assert to_json(from_json(content)) == content


def test_what_shows_only_together_comes_back_and_old_files_have_none(result: Result) -> None:
    groups = (Together(("m", "d", "f"), ratios=True), Together(("a", "b"), ratios=False))
    content = to_json(replace(result, together=groups))
    assert from_json(content).together == groups
    for row in content["parameters"]:
        del row["wrong"]
    del content["together"]
    assert from_json(content).together == ()


def test_null_is_not_a_number(result: Result) -> None:
    content = to_json(replace(result, noise_floor_m=float("nan")))
    assert content["gap"]["noise_floor_m"] is None
    assert to_json(from_json(content)) == content

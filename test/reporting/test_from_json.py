"""result.json and back: what the file says is what the result said."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

import pytest

from compass_ros.reporting.from_json import from_json
from compass_ros.reporting.result_json import read_result, to_json
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


def of_version_1(content: dict[str, Any], phase: str) -> dict[str, Any]:
    """The same as the first version wrote it."""
    content["schema"] = "compass/result/1"
    del content["episodes"]["used"], content["mismatch"]["explanations"], content["mismatch"]["false_alarm"]
    where = content["mismatch"]["where"]
    if where is not None:
        where["phase"] = phase
        for name in ("site_kind", "site", "interval", "depends_on"):
            del where[name]
        for name in ("frame", "centre", "half_extent") if where["region"] is not None else ():
            del where["region"][name]
    return content


@pytest.mark.parametrize(
    ("phase", "today"),
    [("strike", "start"), ("free", "free"), ("wall_contact", "contact"), ("object_contact", "contact"), ("all", "all")],
)
@pytest.mark.parametrize("verdict", get_args(Verdict))
def test_results_of_the_first_version_are_read(
    make_result: Callable[[Verdict], Result], verdict: Verdict, phase: str, today: str, tmp_path: Path
) -> None:
    path = tmp_path / "result.json"
    path.write_text(json.dumps(of_version_1(to_json(make_result(verdict)), phase)))
    read = from_json(read_result(path))
    assert read.mismatch.explanations == ()
    assert read.fit == make_result(verdict).fit
    if read.mismatch.where is not None:
        assert (read.mismatch.where.phase, read.mismatch.where.site_kind) == (today, None)
        assert read.mismatch.where.region == make_result(verdict).mismatch.where.region  # type: ignore[union-attr]
    path.write_text(json.dumps(to_json(read)))
    assert to_json(from_json(read_result(path))) == to_json(read), "and written as of today"


def test_null_is_not_a_number(result: Result) -> None:
    content = to_json(replace(result, noise_floor_m=float("nan")))
    assert content["gap"]["noise_floor_m"] is None
    assert to_json(from_json(content)) == content

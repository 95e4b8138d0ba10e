"""The smallest set of explanations that holds what is asked, and laws that all of them share."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from compass_ros.discovery.search import Found
from compass_ros.discovery.verdict import Judge


def explaining(models: Mapping[str, float]) -> list[str]:
    """Models by their laws, a letter each, that are left open, for their posterior probabilities."""
    laws = {m: [SimpleNamespace(effect=SimpleNamespace(name=letter)) for letter in m] for m in models}
    said = tuple(SimpleNamespace(said=m, physics=laws[m]) for m in models)
    found = Found(cast(Any, None), -800.0, cast(Any, said), tuple(np.log(list(models.values())) + 400.0), ())
    judge = Judge(found, cast(Any, None), cast(Any, None), 0.01, 0.0, np.zeros(1), (), ())
    return [cast(Any, m).said for m in judge._explaining(found.probabilities[2])]


@pytest.mark.parametrize(
    ("models", "left_open"),
    [
        ({"a": 0.995, "b": 0.005}, ["a"]),
        ({"a": 0.6, "b": 0.395, "c": 0.005}, ["a", "b"]),
        ({"ab": 0.6, "a": 0.39, "ac": 0.01}, ["a"]),
        ({"ab": 0.6, "ac": 0.4, "a": 1e-30}, ["ab", "ac"]),
        ({"ab": 0.6, "ac": 0.4}, ["ab", "ac"]),
    ],
    ids=[
        "one",
        "two that differ",
        "one is sure, the rest is open",
        "what is sure is refuted alone",
        "never fitted alone",
    ],
)
def test_what_is_left_open(models: dict[str, float], left_open: list[str]) -> None:
    assert explaining(models) == left_open


def test_odds_that_chance_may_give_leave_the_plain_model_its_share() -> None:
    """One model at log odds of 5: 1 / (1 + e^5) where nothing is rough; each gain by chance is as probable."""
    found = Found(cast(Any, None), -800.0, (cast(Any, None),), (5.0,), ())
    assert found.probabilities[0] == pytest.approx(1 / (1 + np.exp(5.0)))
    rough = replace(found, chance=np.array([0.0, 5.0, 40.0]))
    assert rough.probabilities[0] == pytest.approx((1 / (1 + np.exp(5.0)) + 0.5 + 1.0) / 3)
    assert sum(rough.probabilities[:2]) + rough.probabilities[2].sum() == pytest.approx(1.0)

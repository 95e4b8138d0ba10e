"""A light ball and a heavy one: air is named on one, nothing on the other."""

from __future__ import annotations

from pathlib import Path

import pytest

from compass_ros.cells import load
from compass_ros.real.ball_drops import answer, study
from compass_ros.real.imports import episodes


@pytest.mark.slow
def test_whiffle_and_bowling_ball(real_data: Path, tmp_path: Path) -> None:
    drops = {e.name: e for e in episodes(load("ball_drop"), "ball_drops", tmp_path, real_data)}
    light, heavy = (
        answer(ball, drops[f"{ball}_drop_1"], drops[f"{ball}_drop_2"]) for ball in ("Whiffle_Ball_1", "Bowling_Ball")
    )
    assert (light.verdict, light.law) == ("named", "viscous_drag")
    assert light.over_none > 10
    assert light.second[0] > 2.0
    assert max(light.second[1:]) < 0.2
    assert (heavy.verdict, heavy.law) == ("none", "")


@pytest.mark.slow
def test_one_ball_as_a_study(real_data: Path, tmp_path: Path) -> None:
    found = study(tmp_path, real_data, lambda _: None, ["Golf_Ball"])
    assert [row[:2] for row in found.tables[0].rows] == [("Golf Ball", "none")]

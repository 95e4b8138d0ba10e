"""Runs go on where they were stopped, failures are lines too, and the page says how many kinds agree."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from compass_ros.cells import load
from compass_ros.episodes import read_episodes
from compass_ros.episodes.tables import import_tables
from compass_ros.errors import ConfigError
from compass_ros.operation.current import sources
from compass_ros.real import league
from compass_ros.real.answers import ANSWERS, read_answers
from compass_ros.real.page import BEGIN, END, markdown, write_page
from compass_ros.simulation.replay import recordings
from compass_ros.simulation.windows import windows

ENTRIES, _ = read_answers()
BALLS = league.chosen(ENTRIES, ["ball drops"])


def line(name: str, kind: str, mark: str, **also: Any) -> dict[str, Any]:
    gap = {"nominal": 0.02, "calibrated": 0.01, "with_effects": None, "noise": 0.001, "unit": "rad"}
    known = {"name": name, "kind": kind, "mark": mark, "answers": "abc", "commit": "1", "seconds": 2.0, "error": None}
    return known | {"verdict": "none", "effects": [], "explanations": [], "gap": gap} | also


def test_a_run_goes_on_and_new_answers_ask_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[str] = []

    def judged(entry: Any, *_: Any) -> dict[str, Any]:
        asked.append(entry.name)
        if len(asked) == 3:
            raise KeyboardInterrupt
        return {"mark": "right", "error": None}

    monkeypatch.setattr(league, "judged", judged)
    told: list[str] = []

    def run(answers: str) -> None:
        league.run(BALLS, answers, tmp_path / "l.jsonl", tmp_path, None, 1, lambda one: told.append(one["name"]))

    with pytest.raises(KeyboardInterrupt):
        run("a")
    names = [entry.name for entry in BALLS]
    assert (asked, told) == (names, names[:2])
    run("a")
    assert asked == [*names, names[2]]
    run("a")
    assert len(asked) == 4
    run("b")
    assert asked[4:] == names


def test_a_calibration_that_fails_is_a_line(tmp_path: Path) -> None:
    (tmp_path / "bags" / "ball_drops" / "Golf_Ball_drop_1").mkdir(parents=True)
    found = league.judged(ENTRIES["heavy_balls"], tmp_path, None, 1)
    assert found["mark"] == "no verdict"
    assert "Golf_Ball_drop_1" in found["error"]
    assert "| heavy_balls | **no verdict** | status 1" in markdown([line("heavy_balls", "balls", "no verdict") | found])


def test_recordings_that_nobody_has(tmp_path: Path) -> None:
    (tmp_path / "bags" / "ball_drops").mkdir(parents=True)
    with pytest.raises(ConfigError, match=r"heavy_balls: recordings: no bag in .* is called Bowling_Ball_\*"):
        league.judged(ENTRIES["heavy_balls"], tmp_path, None, 1)


@pytest.mark.parametrize("name", ["so102", "ball_drop", ""])
def test_an_entry_that_is_not_known(name: str) -> None:
    with pytest.raises(ConfigError, match=f"unknown entry '{name}'; known: cube_tosses"):
        league.chosen(ENTRIES, [name])


def test_lines_that_are_none(tmp_path: Path) -> None:
    path = tmp_path / "l.jsonl"
    path.write_text('{"name": "a"}\n[]\n', encoding="utf-8")
    with pytest.raises(ConfigError, match="line 2: not a result of the league"):
        league.read_lines(path)


def test_a_kind_agrees_where_all_of_its_entries_do(tmp_path: Path) -> None:
    lines = [line("a", "balls", "right"), line("b", "balls", "wrong"), line("c", "arm", "class")]
    path = tmp_path / "page.md"
    path.write_text(f"before\n{BEGIN}old\n{END}\nafter\n", encoding="utf-8")
    write_page(path, lines)
    text = path.read_text(encoding="utf-8")
    assert "1 of 2 kinds agree; wrong: b." in text
    assert "| c | **class** | none |  | 20 mrad | 10 mrad |  | 1 mrad | 2 |" in text
    assert text.startswith("before\n")
    assert text.endswith("after\n")
    assert "old" not in text


def test_laws_are_shown_with_their_sizes() -> None:
    sizes = {"coefficient": {"value": 0.28912, "std": 0.0123, "unit": "N m"}}
    named = line("a", "k", "right", verdict="named", effects=[{"name": "coulomb_friction", "parameters": sizes}])
    assert "`coulomb_friction` coefficient 0.289 ± 0.01 N m" in markdown([named])
    rows = [{"laws": [{"name": "drag"}, {"name": "wind"}], "probability": 0.6}, {"laws": [], "probability": 0.4}]
    assert "drag + wind (0.60), none (0.40)" in markdown(
        [line("a", "k", "class", verdict="ambiguous", explanations=rows)]
    )


@pytest.mark.parametrize("name", ["whiffle_balls_small", "heavy_balls", "pendulum_single", "torque_pendulum"])
def test_real_recordings_are_what_the_cell_sees(name: str, real_data: Path, tmp_path: Path) -> None:
    """Every pattern fits a recording, at least four of them, and all begin where their simulation does."""
    entry = ENTRIES[name]
    import_tables(ANSWERS.parent / "import" / f"{entry.tables}.yaml", tmp_path / "bags" / entry.tables, real_data)
    cell, bags = load(entry.cell), league.bags(entry, tmp_path, real_data)
    assert all(any(b.match(pattern) for b in bags) for pattern in entry.recordings)
    assert len(bags) >= 4
    seen = recordings(cell, windows(cell, read_episodes(bags[:4], sources(cell), cell.name)))
    assert len(seen.names) >= 4
    assert np.isfinite(seen.measured[:, 0]).any(axis=-1).all()

"""Marks of rivals, their table, and a sealed world through the real command line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from compass_ros.executors import Threads
from compass_ros.proof import rivals
from compass_ros.proof.campaign import Plan, prove
from compass_ros.proof.lines import read
from compass_ros.proof.one_world import Suite
from compass_ros.proof.rivals_table import BEGIN, END, rows, write_page

TILT = {"name": "table_tilt", "outside": False, "twins": ["crosswind"]}
DRAG = {"name": "viscous_drag", "outside": False, "twins": []}
GHOST = {"name": "creeping_jet", "outside": True, "twins": []}


@pytest.mark.parametrize(
    ("kind", "effects", "names", "right", "misnamed"),
    [
        ("one", [TILT], ["table_tilt"], True, False),
        ("one", [TILT], ["crosswind"], True, False),
        ("one", [TILT], ["table_tilt", "magnus"], False, True),
        ("one", [TILT], [], False, False),
        ("two", [TILT, DRAG], ["viscous_drag", "crosswind"], True, False),
        ("two", [TILT, DRAG], ["viscous_drag"], False, False),
        ("none", [], [], True, False),
        ("none", [], ["magnus"], False, True),
        ("outside", [GHOST], ["magnus"], False, True),
    ],
)
def test_names_are_judged_like_ours(
    kind: str, effects: list[dict[str, Any]], names: list[str], right: bool, misnamed: bool
) -> None:
    marks = rivals.marked({"names": names}, {"kind": kind, "effects": effects})
    assert (marks["right"], marks["misnamed"]) == (right, misnamed)


def test_who_names_nothing_is_neither_right_nor_wrong() -> None:
    marks = rivals.marked({"names": None}, {"kind": "one", "effects": [TILT]})
    assert (marks["right"], marks["misnamed"]) == (None, None)


def said(**given: Any) -> dict[str, Any]:
    nothing = dict.fromkeys(("names", "right", "misnamed", "alarm", "p_value", "held_out_m"))
    return nothing | {"seconds": 3.0} | given


def line(seed: int, kind: str, **of: dict[str, Any]) -> dict[str, Any]:
    return {
        "suite": "main", "seed": seed, "method": "rivals", "commit": "c", "error": None, "kind": kind,
        "floor_m": 1.4e-3, "rivals": of,
    }  # fmt: skip


def test_the_table_puts_ours_first_and_says_what_does_not_apply() -> None:
    theirs = [
        line(1, "one", sbi=said(alarm=True, p_value=0.0), sindy=said(names=["swirl"], right=True, misnamed=False)),
        line(2, "none", sbi=said(alarm=True, p_value=0.01), sindy=said(names=[], right=True, held_out_m=1.5e-3)),
    ]
    marks = {"kind": "one", "right": True, "misnamed": False, "verdict": "named"}
    held = {"calibrated": 3e-3, "with_effects": 1.5e-3, "floor": 1.4e-3}
    ours = [
        {"suite": "main", "seed": seed, "method": method, "marks": marks | {"held_out_m": held},
         "seconds": {"calibrate": 60.0}}
        for seed, method in ((1, "default"), (7, "default"), (1, "compass"))
    ]  # fmt: skip
    first, sbi, sindy = rows(theirs, ours)
    assert first[:2] == ("compass_ros", "1 of 1 (21 to 100 %)"), "7 is no world of the rivals, compass not our method"
    assert first[6:] == ("1.50", "0.10", "60")
    assert sbi[1] == "n/a"
    assert sbi[4].startswith("1 of 1")
    assert sindy[1].startswith("1 of 1")
    assert sindy[6:8] == ("1.50", "0.10")


def test_a_world_that_our_table_leaves_out_is_left_out_here() -> None:
    theirs = [line(seed, "one", sbi=said(alarm=False)) for seed in (1, 2)]
    strong, faint = [
        {"suite": "main", "seed": seed, "method": "default", "effects": [{"rms_m": rms_m}]}
        for seed, rms_m in ((1, 2e-3), (2, 0.4e-3))
    ]
    assert rows(theirs, [strong, faint])[0][5].startswith("0 of 1 ")


def test_a_page_gets_the_table_between_its_own_markers(tmp_path: Path) -> None:
    page = tmp_path / "proof.md"
    page.write_text(f"before\n{BEGIN}\nold\n{END}\nafter\n")
    write_page(page, [line(1, "one", sbi=said(alarm=True))], [])
    text = page.read_text()
    assert "old" not in text
    assert "| sbi | n/a |" in text
    assert text.endswith(f"{END}\nafter\n")


def test_worlds_are_run_again_when_the_rivals_change(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, done = tmp_path / "rivals.jsonl", []

    def run(key: Any) -> dict[str, object]:
        done.append(key.seed)
        return {"error": None, "rivals": {}}

    def plan() -> Plan:
        return Plan(("main",), 2, rivals.METHOD, 5, rivals.PARTS)

    prove(plan(), path, Threads(1), lambda *_: None, run)
    prove(plan(), path, Threads(1), lambda *_: None, run)
    assert done == [5, 6]
    monkeypatch.setattr(rivals, "PARTS", ("errors.py",))
    prove(plan(), path, Threads(1), lambda *_: None, run)
    assert done == [5, 6, 5, 6]
    assert len(read(path)) == 2


@pytest.mark.nightly
def test_a_sealed_world_through_a_rival() -> None:
    suite = Suite("off centre", ("--effect", "off_centre_mass", "--rms", "6e-3"), 3)
    found: Any = rivals.run(suite, 3, 1, ["calibrated"])
    assert found["error"] is None, found["error"]
    assert found["truth"] == ["off_centre_mass"]
    assert found["rivals"]["calibrated"]["held_out_m"] > found["floor_m"]

"""The results file, stopping and going on, and the numbers of the table."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from compass_ros.errors import ConfigError
from compass_ros.executors import Threads
from compass_ros.proof import campaign, lines
from compass_ros.proof.campaign import Plan, prove
from compass_ros.proof.lines import Key
from compass_ros.proof.one_world import SUITES
from compass_ros.proof.page import BEGIN, END, write_page
from compass_ros.proof.statistics import table
from test.conftest import Run

PLAN = Plan(("main",), worlds=3)
SEEDS = [SUITES["main"].first_seed + i for i in range(3)]


def marks(**given: Any) -> dict[str, Any]:
    standard = {
        "kind": "one",
        "truth": ["swirl"],
        "found": ["swirl"],
        "verdict": "named",
        "right": True,
        "misnamed": False,
        "first_right": True,
        "object_right": True,
        "phase_right": True,
        "channel_right": True,
        "centre_error_m": 0.01,
        "parameters": [{"error": 0.03, "covered": True}],
        "gain": 0.95,
    }
    return standard | given


def outcome(**given: Any) -> dict[str, Any]:
    return {"error": None, "seconds": {"conceal": 9.0, "calibrate": 60.0}, "marks": marks(**given)}


class Runner:
    """Stands for the command line: notes what was run, and answers."""

    def __init__(self, stop_after: int = 99) -> None:
        self.seeds: list[int] = []
        self._left = stop_after

    def __call__(self, key: Key) -> dict[str, object]:
        if not self._left:
            raise KeyboardInterrupt
        self._left -= 1
        self.seeds.append(key.seed)
        return outcome()


def quiet(*_: object) -> None: ...


def test_a_stopped_run_goes_on_where_it_was(tmp_path: Path) -> None:
    path, first, second = tmp_path / "proof" / "results.jsonl", Runner(stop_after=2), Runner()
    with pytest.raises(KeyboardInterrupt):
        prove(PLAN, path, Threads(1), quiet, first)
    assert sorted(key.seed for key in lines.read(path)) == first.seeds == SEEDS[:2]
    prove(PLAN, path, Threads(1), quiet, second)
    assert second.seeds == SEEDS[2:]
    assert [json.loads(line)["seed"] for line in path.read_text().splitlines()] == SEEDS


@pytest.mark.parametrize("what", ["METHOD", "WORLDS"])
def test_worlds_of_an_older_method_are_run_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, what: str) -> None:
    path, again, done = tmp_path / "results.jsonl", Runner(), Runner()
    prove(PLAN, path, Threads(2), quiet, Runner())
    prove(PLAN, path, Threads(1), quiet, done)
    assert done.seeds == []
    monkeypatch.setattr(lines, what, ("errors.py",))
    prove(PLAN, path, Threads(1), quiet, again)
    assert again.seeds == SEEDS
    assert len(lines.read(path)) == 3


def test_a_run_that_failed_is_kept_counted_and_tried_again(tmp_path: Path) -> None:
    path, again = tmp_path / "results.jsonl", Runner()
    failed = {"error": "calibrate: status 1: no", "kind": "one", "truth": ["swirl"]}
    prove(Plan(("main",), 1), path, Threads(1), quiet, lambda key: dict(failed))
    (line,) = lines.read(path).values()
    assert table([line])[0].count == "0 of 1"
    prove(Plan(("main",), 1), path, Threads(1), quiet, again)
    assert again.seeds == SEEDS[:1]


def test_a_line_says_what_made_it(tmp_path: Path) -> None:
    path = tmp_path / "results.jsonl"
    prove(Plan(("small",), 1, method="compass", first_seed=7), path, Threads(1), quiet, Runner())
    (line,) = lines.read(path).values()
    assert (line["suite"], line["seed"], line["method"], line["jobs"]) == ("small", 7, "compass", 1)
    assert line["method_sources"] == lines.sources(lines.METHOD)
    assert line["commit"] == campaign.commit()


def test_methods_stand_beside_each_other(tmp_path: Path) -> None:
    path = tmp_path / "results.jsonl"
    for method in ("default", "compass"):
        prove(Plan(("main",), 1, method=method), path, Threads(1), quiet, Runner())
    assert len(lines.read(path)) == 2


def test_a_damaged_file_is_one_line(tmp_path: Path) -> None:
    path = tmp_path / "results.jsonl"
    path.write_text('{"suite": "main"}\n')
    with pytest.raises(ConfigError, match="line 1: not a result of a world"):
        lines.read(path)


def test_the_hash_of_sources_changes_with_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lines, "PACKAGE", tmp_path)
    (tmp_path / "part").mkdir()
    source = tmp_path / "part" / "a.py"
    source.write_text("x = 1\n")
    before = lines.sources(["part"])
    assert lines.sources(["part"]) == before
    source.write_text("x = 2\n")
    assert lines.sources(["part"]) != before


def worlds(*given: dict[str, Any]) -> list[dict[str, Any]]:
    return [
        {"suite": "main", "seed": i, "method": "default", "commit": "c"} | outcome(**g) for i, g in enumerate(given)
    ]


def test_shares_have_wilson_s_interval() -> None:
    """Of 20 worlds 19: Wilson 1927 gives 76.4 to 99.1 %."""
    row = table(worlds(*[{}] * 19, {"right": False, "verdict": "none", "found": []}))[0]
    assert (row.value, row.interval, row.count, row.reached) == ("95 %", "76 to 99 %", "19 of 20", True)


def test_rows_look_at_their_own_worlds() -> None:
    found = worlds(
        {},
        {"right": False, "misnamed": True, "phase_right": False, "first_right": False},
        {"kind": "none", "truth": [], "verdict": "none", "parameters": [], "gain": None},
        {"kind": "two", "parameters": [{"error": 0.2, "covered": False}], "right": False},
        {"kind": "outside", "verdict": "unknown", "parameters": [], "gain": None, "apart_m": 2e-3},
        {"kind": "outside", "verdict": "unknown", "parameters": [], "gain": None, "apart_m": 2e-4},
    )
    rows = {row.what: row for row in table(found)}
    assert rows["one effect, named right or within its class"].count == "1 of 2"
    assert rows["of these, first name right where the class has one member"].count == "1 of 1"
    assert rows["one effect: misnamed"].reached is False
    assert rows["one effect: object, phase and channel right"].count == "1 of 2"
    assert rows["two effects, both named or within their classes"].reached is False
    assert rows["nothing missing: none"].value == "100 %"
    assert rows["outside the library: unknown"].reached is True
    assert rows["outside the library: unknown"].count == "2 of 2"
    assert rows["of these, where no formula of the library comes within 1 mm rms"].count == "1 of 1"
    assert rows["parameters of effects: median error"].value == "3.0 %"
    assert rows["parameters of effects: 90 % intervals hold the truth"].count == "2 of 3"


def test_only_worlds_with_two_cores_to_themselves_are_timed() -> None:
    found = worlds({}, {}, {})
    assert times(found) == [("-", None), ("60", None)]
    found[0] |= {"jobs": 1, "threads": 2, "seconds": {"calibrate": 70.0}}
    found[1] |= {"jobs": 1, "threads": 2, "seconds": {"calibrate": 100.0}}
    found[2] |= {"jobs": 2, "threads": 2}
    assert times(found) == [("85", True), ("60", None)]
    assert times(found[1:2]) == [("100", False)]


def times(found: list[dict[str, Any]]) -> list[tuple[str, bool | None]]:
    return [(row.value, row.reached) for row in table(found) if "[s]" in row.what]


def test_small_effects_ask_for_modesty() -> None:
    missed = {"right": False, "found": []}
    found = worlds(*[{}] * 8, missed | {"verdict": "none"}, missed | {"verdict": "unknown"})
    rows = table([line | {"suite": "small"} for line in found])
    assert [(row.count, row.reached) for row in rows[:3]] == [("8 of 10", True), ("1 of 2", False), ("0 of 10", True)]


def test_the_tracker_s_noise_may_cost_five_points() -> None:
    found = worlds(*[{}] * 9, {"right": False})
    assert [table([line | {"suite": s} for line in found])[0].reached for s in ("main", "tracker")] == [False, True]


def test_an_effect_that_parameters_absorb_is_not_asked_for() -> None:
    strong, weak = ({"effects": [{"rms_m": 2e-3}, {"rms_m": rms_m}]} for rms_m in (1.2e-3, 4e-4))
    found = [line | effects for line, effects in zip(worlds({}, {}), (strong, weak), strict=True)]
    assert table(found)[0].count == "1 of 1"
    assert (table(found)[-1].value, table(found)[-1].count) == ("1", "2")
    assert table([line | {"suite": "small"} for line in found])[0].count == "2 of 2", "small by intent"


def test_an_effect_that_the_calibrated_parameters_absorb_is_not_asked_for() -> None:
    said = {"effects": [{"rms_m": 5e-3}]}
    found = [line | said for line in worlds({"left_m": 3e-4, "right": False}, {"left_m": 4e-3}, {"left_m": None})]
    assert table(found)[0].count == "2 of 2"
    nothing = worlds({"kind": "none", "left_m": 0.0})
    assert table(nothing)[-1].value == "0", "where nothing is missing nothing is left"


def test_no_worlds_make_no_claims() -> None:
    assert all(row.reached is None for row in table([]))


def test_the_page_keeps_its_text_and_lists_what_was_wrong(tmp_path: Path) -> None:
    page = tmp_path / "proof.md"
    page.write_text(f"before\n{BEGIN}stale text\n{END}\nafter\n")
    write_page(page, worlds({}, {"right": False, "verdict": "named", "found": ["magnus"]}))
    text = page.read_text()
    assert text.startswith(f"before\n{BEGIN}###")
    assert text.endswith(f"{END}\nafter\n")
    assert "stale text" not in text
    assert "| swirl | named: magnus | 1 |" in text
    assert "50 %" in text
    page.write_text("no markers")
    with pytest.raises(ConfigError, match="expected the markers"):
        write_page(page, [])


def test_the_table_of_the_proof_says_its_units(run: Run) -> None:
    proof = Path(__file__).parents[2] / "proof"
    results, rivals = proof / "results-265f55f.jsonl", proof / "rivals-265f55f.jsonl"
    status, out, _ = run("prove", "--table", "--out", results, "--rivals-out", rivals)
    assert status == 0
    assert "median [s]" in " ".join(out.replace("│", " ").split())
    assert "held out [mm]" in " ".join(out.replace("┃", " ").split())

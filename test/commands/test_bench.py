"""`compass bench`: which cases a command line means, a small run, and drawing what is there."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from compass_ros.bench.case import Case
from compass_ros.bench.outcome import case_of, read
from compass_ros.bench.run import RESULTS
from compass_ros.calibration.methods import METHODS
from compass_ros.commands.bench import BEGIN, END, chosen
from test.conftest import Run

TINY = ("--iterations", 2, "--real", 2, "--sim", 2, "--seeds", 1)
BASE = Case("", "", 0, iterations=3, real=5, sim=8, missing=0.2, start="random")


def test_names_of_methods_are_settled_so_that_a_case_has_one_key() -> None:
    cases = chosen(["air_hockey"], ["default", "causal-map", "random"], 2, [0.0, 0.001], BASE, ablations=False)
    assert {c.method for c in cases} == {"causal-map", "random"}
    assert len(cases) == 2 * 2 * 2
    assert {(c.iterations, c.real, c.sim, c.missing, c.start) for c in cases} == {(3, 5, 8, 0.2, "random")}
    auto = chosen(["air_hockey"], ["random"], 1, [0.0], replace(BASE, parameters="auto"), ablations=False)
    assert {c.parameters for c in auto} == {"auto"}
    every = chosen(["air_hockey", "push_i"], ["all"], 1, [0.0], BASE, ablations=False)
    assert {c.method for c in every} == set(METHODS)
    assert {c.task for c in every} == {"air_hockey", "push_i"}


def test_ablations_take_tasks_methods_seeds_and_iterations() -> None:
    cases = chosen(["air_hockey"], ["compass"], 2, [0.0], BASE, ablations=True)
    assert {c.iterations for c in cases} == {3}
    assert {c.seed for c in cases} == {0, 1}
    assert {c.real for c in cases} == {5, 10, 20}


def test_a_run_is_written_resumed_and_drawn(run: Run, tmp_path: Path) -> None:
    status, out, err = run("bench", "--method", "random", *TINY, "--noise", 0.001, "--out", tmp_path)
    assert (status, err) == (0, "")
    assert f"1 cases run, 0 were there already: {tmp_path}" in out
    assert "### air_hockey: iterations=2, real=2, sim=2, noise_m=0.001" in out
    assert "| random | 1 |" in out
    (row,) = read(tmp_path / RESULTS)
    assert case_of(row) == Case("air_hockey", "random", 0, 2, 2, 2, noise_m=0.001)
    _, out, _ = run("bench", "--method", "random", *TINY, "--noise", 0.001, "--out", tmp_path)
    assert "0 cases run, 1 were there already" in out
    before = (tmp_path / RESULTS).read_bytes()
    page = tmp_path / "page.md"
    page.write_text(f"before\n{BEGIN}old\n{END}\nafter\n")
    status, out, _ = run("bench", "--table", "--out", tmp_path, "--page", page)
    assert status == 0
    assert out.startswith("### air_hockey")
    assert page.read_text() == f"before\n{BEGIN}\n{out}\n{END}\nafter\n"
    status, out, _ = run("bench", "--figures", "--out", tmp_path)
    assert status == 0
    assert (tmp_path / RESULTS).read_bytes() == before


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--method", "rnadom"), "unknown method 'rnadom'"),
        (("--task", "air_hokey"), "did you mean 'air_hockey'?"),
        (("--table",), "no results; run `compass bench --out"),
    ],
)
def test_bad_input_is_one_line(words: tuple[str, ...], said: str, run: Run, tmp_path: Path) -> None:
    status, out, err = run("bench", *words, "--out", tmp_path / "out")
    assert (status, out) == (1, "")
    assert err.count("\n") == 1
    assert said in err
    assert not (tmp_path / "out").exists()


def test_ablations_beside_what_they_vary_is_wrong_use(run: Run, tmp_path: Path) -> None:
    assert run("bench", "--ablations", "--real", 5, "--out", tmp_path)[0] == 2
    assert run("bench", "--ablations", "--parameters", "auto", "--out", tmp_path)[0] == 2
    assert run("bench", "--parameters", "all", "--out", tmp_path)[0] == 2
    assert run("bench", "--seeds", 0, "--out", tmp_path)[0] == 2

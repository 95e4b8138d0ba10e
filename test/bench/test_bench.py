"""The benchmark's own machinery: what a case is, resuming, scores against planted truths, tables and figures."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

from compass_ros.bench.case import Case, ablations, grid
from compass_ros.bench.edges import score_edges, total_effects
from compass_ros.bench.figures import write_figures
from compass_ros.bench.outcome import append, case_of, percentage_errors, read
from compass_ros.bench.run import RESULTS, run_bench
from compass_ros.bench.table import coverage, tables
from compass_ros.bench.world import build
from compass_ros.cells import load
from compass_ros.errors import ConfigError, DataError
from compass_ros.types import Progress
from test.calibration.planted import planted
from test.calibration.test_rivals import Meter

TINY = Case("air_hockey", "random", 0, iterations=2, real=2, sim=2)


def test_a_grid_has_each_combination_once_and_a_key_tells_cases_apart() -> None:
    cases = grid(["air_hockey"], ["compass", "random"], range(3), [0.0, 0.001], replace(TINY, sparse_weight=0.01))
    assert len(cases) == 12
    assert len({c.key for c in cases}) == 12
    assert {c.sparse_weight for c in cases if c.method == "random"} == {None}
    assert Case(**json.loads(json.dumps(cases[3].__dict__))).key == cases[3].key


def test_every_field_of_the_scene_is_a_case_of_its_own(tmp_path: Path) -> None:
    """The same shots and truth, more to find; a line without the choice is one of the cell's own parameters."""
    auto = replace(TINY, parameters="auto")
    assert auto.key != TINY.key
    assert auto.setting().endswith("parameters=auto")
    assert grid(["air_hockey"], ["random"], [0], [0.0], auto) == (auto,)
    few, many = build(TINY), build(auto)
    assert len(many.problem.parameters) >= 400
    assert many.causal == few.causal
    assert np.array_equal(many.truth[:64], few.truth)
    assert np.array_equal(many.truth[64:], many.problem.start[64:])
    assert np.abs(many.problem.measured - few.problem.measured).max() < 1e-9
    assert run_bench((TINY, auto), tmp_path) == 2
    assert run_bench((auto, TINY), tmp_path) == 0
    older = [json.loads(line) for line in (tmp_path / RESULTS).read_text().splitlines()][:1]
    del older[0]["case"]["parameters"]
    assert case_of(older[0]) == TINY
    assert "### air_hockey: iterations=2, real=2, sim=2, parameters=auto" in tables(read(tmp_path / RESULTS))


def test_ablations_vary_one_thing_at_a_time() -> None:
    cases = ablations("air_hockey", ["compass"], [0])
    assert len(cases) == len(set(cases))
    usual = Case("air_hockey", "compass", 0)
    for case in cases:
        changed = [n for n, v in case.__dict__.items() if v != getattr(usual, n)]
        assert len(changed) <= 1
    assert {c.real for c in cases} == {5, 10, 20}
    assert {c.sim for c in cases} == {32, 64, 128}
    assert {c.sparse_weight for c in cases} == {None, 0.001, 0.005, 0.01}


def test_percentage_errors() -> None:
    errors = percentage_errors(np.array([-5.0, 0.03, 0.5]), np.array([-10.0, 0.02, 0.0]))
    assert np.allclose(errors, [0.5, 0.5, 0.5])


def test_total_effects_find_the_planted_edges() -> None:
    world = planted(6, 3, episodes=4, seed=3)
    effects = total_effects(Meter(world).problem, points=40)
    assert np.all(effects[world.edges] > 0.02)
    assert np.all(effects[~world.edges] < 1e-9)
    exact = score_edges(effects > 0.01, world.edges)
    assert (exact.precision, exact.recall, exact.missed, exact.extra) == (1.0, 1.0, (), ())


def test_edge_scores_by_hand() -> None:
    true = np.array([[1, 0], [0, 1], [0, 0], [1, 1]], dtype=bool)
    kept = np.array([[1, 0], [0, 0], [1, 0], [1, 0]], dtype=bool)
    scored = score_edges(kept, true)
    assert scored.kept == 3
    assert scored.precision == pytest.approx(2 / 3)
    assert scored.recall == pytest.approx(2 / 4)
    assert (scored.missed, scored.extra) == ((1,), (2,))


def test_worlds_repeat_and_differ_by_seed_noise_and_gaps() -> None:
    first, again = build(TINY), build(TINY)
    assert first.problem.measured.tobytes() == again.problem.measured.tobytes()
    other = build(replace(TINY, seed=1))
    assert not np.array_equal(first.problem.actions, other.problem.actions)
    rough = build(replace(TINY, noise_m=0.001, missing=0.2))
    share = float(np.mean(rough.problem.weight == 0))
    assert share == pytest.approx(0.2, abs=0.05)
    seen = (rough.problem.weight > 0) & (first.problem.weight > 0)[
        : len(rough.problem.weight), : rough.problem.weight.shape[1]
    ]
    assert seen.any()
    judged = rough.noisy.gap(rough.truth)
    assert judged.rmse_m == pytest.approx(0.001 * np.sqrt(2), rel=0.05)
    assert first.clean.gap(first.truth).rmse_m < 1e-9
    random = build(replace(TINY, start="random"))
    assert not np.array_equal(random.problem.start, first.problem.start)
    assert random.problem.actions.tobytes() == first.problem.actions.tobytes()


def test_a_run_resumes_after_a_torn_line_and_repeats_nothing(tmp_path: Path) -> None:
    cases = (TINY, replace(TINY, method="cma-es"))
    assert run_bench(cases[:1], tmp_path) == 1
    path = tmp_path / RESULTS
    with path.open("a") as file:
        file.write('{"schema": "compass/be')  # killed while writing
    shares: list[float] = []

    def watch(progress: Progress) -> bool:
        shares.append(progress.done)
        return True

    assert run_bench(cases, tmp_path, watch) == 1
    assert run_bench(cases, tmp_path) == 0
    rows = read(path)
    assert [case_of(r) for r in rows] == list(cases)
    assert shares == sorted(shares)
    assert shares[0] >= 0.5  # half was there already
    assert rows[0]["rollouts"] == rows[0]["rollouts_counted_by_simulator"]
    text = tables(rows)
    assert "| random | 1 |" in text
    assert "| cma-es | 1 |" in text


def test_stopping_writes_nothing_of_the_running_case(tmp_path: Path) -> None:
    assert run_bench((TINY,), tmp_path, lambda progress: False) == 0
    assert not (tmp_path / RESULTS).exists()


def test_a_wrong_method_ends_before_anything_runs(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"unknown method 'rnadom'.*did you mean 'random'"):
        run_bench((TINY, replace(TINY, method="rnadom")), tmp_path)
    assert not (tmp_path / RESULTS).exists()


def test_foreign_results_are_refused(tmp_path: Path) -> None:
    append(tmp_path / RESULTS, {"schema": "other/1"})
    with pytest.raises(DataError, match=r"results\.jsonl:1: expected a line of schema compass/bench/1"):
        read(tmp_path / RESULTS)


def _row(case: Case, difference: float) -> dict[str, object]:
    """A row as `outcome` writes it, without a run."""
    psi = np.zeros((64, 2))
    psi[[4, 8]] = 1.0
    step = {"values": [0.5] * 2, "difference": [1.0, difference], "rollouts": 10, "psi": psi.tolist()}
    return {
        "schema": "compass/bench/1",
        "case": dict(case.__dict__),
        "causal": ["puck1@dyna@damping", "puck2@dyna@damping"],
        "factors": ["puck1", "puck2"],
        "mape": 0.2,
        "mape_identified": None,
        "identified": [],
        "held_out": {"d": {"puck1": difference, "puck2": difference}, "rmse_m": 0.01},
        "held_out_nominal": {"d": {"puck1": 4.0, "puck2": 4.0}, "rmse_m": 0.1},
        "held_out_over_floor": None,
        "edges": {"kept": 2, "precision": 1.0, "recall": None, "missed": [], "extra": []},
        "rollouts": 20,
        "rollouts_counted_by_simulator": 20,
        "simulated_seconds": 50.0,
        "wall_seconds": 1.5,
        "trace": [step, step | {"rollouts": 20, "difference": [0.5, difference / 2]}],
    }


def test_tables_have_means_over_seeds_and_the_papers_number() -> None:
    rows = [_row(Case("air_hockey", "compass", seed), 1.0 + seed) for seed in range(3)]
    rows.append(_row(Case("air_hockey", "npdr", 0), 0.5))
    lines = tables(rows).splitlines()
    assert lines[0] == "### air_hockey"
    assert lines[2].endswith("| rollouts | simulated [s] | wall [s] |")
    assert lines[4].endswith("| 20 | 50 | 1.5 |")
    assert lines[4].startswith("| npdr | 1 | 0.2 | 0.29 |")  # the smaller difference first
    assert lines[5].startswith("| compass | 3 | 0.2 ± 0 | 0.22 | - (0.0) | 2 ± 1 | 0.5 ± 0.25 |")


def test_coverage_counts_the_parameters_that_a_method_is_sure_of() -> None:
    known = load("air_hockey").spec.parameters
    truth = {p.name: p.default if p.target is None else p.target for p in known}
    sure = {p.name: 0.1 * p.half_width for p in known}
    off = truth | {"puck1@dyna@damping": -6.9, "puck2@dyna@damping": -6.5, "env@camera@bias_x": 0.5}
    std: dict[str, float | None] = {**sure, "env@camera@bias_x": None, "env@camera@bias_y": 1.0}
    row = _row(Case("air_hockey", "causal-map", 0, noise_m=0.001), 1.0) | {"values": off, "std": std}
    assert coverage([row]) == "98 % of 62"  # -6.9 is 1.8 standard deviations off, -6.5 one
    assert coverage([row | {"case": asdict(Case("air_hockey", "causal-map", 0))}]) == "-"


def test_figures_are_drawn_for_what_is_there(tmp_path: Path) -> None:
    base = Case("air_hockey", "compass", 0)
    varied = [replace(base, real=5), replace(base, sim=32), replace(base, start="random")]
    varied += [replace(base, sparse_weight=w) for w in (0.001, 0.01)]
    written = write_figures([_row(c, 1.0) for c in (base, replace(base, seed=1), *varied)], tmp_path)
    assert sorted(p.name for p in written) == [
        "ablation-real-air_hockey.png",
        "ablation-sim-air_hockey.png",
        "difference-air_hockey-noise-0mm.png",
        "difference-random-start-air_hockey.png",
        "parameters-air_hockey-noise-0mm.png",
        "psi-iterations-air_hockey.png",
        "psi-weights-air_hockey.png",
    ]
    assert all(p.read_bytes()[:4] == b"\x89PNG" for p in written)

"""The method as a whole: what is held out stays out, and the same bags give the same bits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from compass_ros import estimation, pipeline
from compass_ros.assembly import assemble
from compass_ros.calibration.noise import Noise, measure_noise
from compass_ros.cells import Cell, load
from compass_ros.config import CalibrationConfig
from compass_ros.discovery import Discovery, fit_failed, not_evaluated
from compass_ros.errors import DataError
from compass_ros.pipeline import calibrate
from compass_ros.posing import Posed, launched, noise_floor
from compass_ros.reporting.from_json import from_json
from compass_ros.reporting.result_json import to_json
from compass_ros.simulation import Simulator
from compass_ros.simulation.replay import Replay, recordings
from compass_ros.types import Episode, Estimate, Progress, Result, Track
from test.simulation.table import actions, cell, simulator, values

START = 1_700_000_000_000_000_000
NOISE = 5e-4
TRUTH = {"pusher@actuation@vel_discount": 0.85, "puck2@dyna@friction_sliding": 0.03, "env@camera@bias_x": 0.03}
CONFIG = CalibrationConfig(method="random", rollouts=32, discover=False, seed=3, held_out_share=0.25)
FIELDS = ("x", "y", "angle", "velocity")


def named(*names: str) -> list[Episode]:
    return [Episode(name, "air_hockey", "", {}, START + i, ()) for i, name in enumerate(names)]


@pytest.fixture(scope="module")
def episodes() -> list[Episode]:
    """Six shots with hidden parameters, half a second still before each, at 60 Hz."""
    shots = actions(6, seed=9)
    stamps = START + np.round(np.arange(-0.5, 2.5, 1 / 60) * 1e9).astype(np.int64)
    times = np.tile((stamps - START) * 1e-9, (len(shots), 1))
    seen = simulator().observe(values(TRUTH, len(shots)), shots, times)
    seen = seen + np.random.default_rng(0).normal(0, NOISE, seen.shape)
    return [
        Episode(
            name=f"shot{i}",
            cell="air_hockey",
            cell_hash=cell().hash,
            action=dict(zip(FIELDS, shots[i].tolist(), strict=True)),
            start_ns=START,
            tracks=tuple(Track(f"puck{k + 1}", "xy", stamps, seen[i][:, 2 * k : 2 * k + 2]) for k in range(2)),
        )
        for i in range(len(shots))
    ]


@pytest.fixture(scope="module")
def result(episodes: list[Episode]) -> Result:
    return calibrate(episodes, cell(), CONFIG)[0]


def found(result: Result) -> list[float]:
    return [row.value for row in result.parameters]


def test_an_even_choice_is_said(episodes: list[Episode], result: Result) -> None:
    few, _ = calibrate(episodes, cell(), replace(CONFIG, episodes=4))
    assert len(few.fit) + len(few.held_out) == 4
    assert few.warnings[0].startswith("4 of 6 episodes were used")
    assert not any("were used" in said for said in result.warnings)


def test_what_is_held_out_is_never_fitted(episodes: list[Episode], result: Result) -> None:
    """Spoil the held-out recordings: not one bit of the values moves, while the held-out gap does."""
    spoilt = [
        replace(e, tracks=tuple(replace(t, value=t.value + 0.05) for t in e.tracks)) if e.name in result.held_out else e
        for e in episodes
    ]
    again = calibrate(spoilt, cell(), CONFIG)[0]
    assert result.held_out
    assert set(result.fit) | set(result.held_out) == {e.name for e in episodes}
    assert found(again) == found(result)
    assert again.gap["calibrated"]["fit"] == result.gap["calibrated"]["fit"]
    assert again.gap["calibrated"]["held_out"].rmse_m > result.gap["calibrated"]["held_out"].rmse_m + 0.01


def test_the_same_bags_in_any_order_on_any_threads_give_the_same_bits(episodes: list[Episode], result: Result) -> None:
    again = calibrate(episodes[::-1], cell(), replace(CONFIG, threads=1))[0]
    assert found(again) == found(result)
    assert again.gap == result.gap
    assert (again.fit, again.held_out) == (result.fit, result.held_out)


def test_the_noise_floor_is_that_of_the_recordings(result: Result) -> None:
    """Root mean square distance of two coordinates with that noise each."""
    assert result.noise_floor_m == pytest.approx(NOISE * np.sqrt(2), rel=0.1)


def test_the_result_holds_what_the_report_draws(result: Result) -> None:
    assert [row.name for row in result.parameters] == [p.name for p in cell().parameters]
    assert {r.episode for r in result.replays if r.held_out} == set(result.held_out)
    assert result.mismatch.verdict == "not_evaluated"
    nominal = result.gap["nominal"]["fit"]
    assert nominal.d["puck2"] > 1.0
    drawn = result.replays[0].tracks[0]
    assert drawn.real.shape == drawn.nominal.shape == drawn.calibrated.shape
    assert drawn.with_effects is None


def test_the_values_of_the_truth_reach_the_noise_floor(episodes: list[Episode], result: Result) -> None:
    """The gap that is reported is zero but for noise where nothing is wrong: a check of the yardstick itself."""
    at_truth = Replay(simulator(), recordings(cell(), episodes)).gap(values(TRUTH)[0])
    assert at_truth.rmse_m == pytest.approx(result.noise_floor_m, rel=0.1)


@pytest.mark.parametrize("name", ["compass", "npdr", "exi-net", "tune-net", "mujoco-sysid", "cma-es", "random"])
def test_no_method_ends_farther_than_it_began(
    episodes: list[Episode], monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    """Whatever it returns; the same numbers stand as nominal and as calibrated then, and it is said."""
    far = cell().values({"pusher@actuation@vel_discount": 0.5})
    sure = np.zeros(len(far), dtype=bool)
    bad = Estimate(name, far, 0.01 * np.abs(far), sure, None, (), 0, True, "done")
    monkeypatch.setattr(estimation, "_estimate", lambda *_: (bad, None))
    result, _ = calibrate(episodes, cell(), replace(CONFIG, method=name))
    assert found(result) == cell().defaults.tolist()
    assert result.gap["calibrated"] == result.gap["nominal"]
    assert result.warnings[0].endswith("the defaults stay")


@pytest.mark.parametrize("alpha", [0.0001, 0.001, 0.01, 0.05, 0.3])
def test_the_search_is_told_the_false_alarm_rate_that_was_asked_for(
    episodes: list[Episode], monkeypatch: pytest.MonkeyPatch, alpha: float
) -> None:
    asked: list[object] = []

    def discover(*given: object) -> Discovery:
        asked.append(given[4])
        return not_evaluated("it was asked only")

    monkeypatch.setattr(pipeline, "refine", lambda *_: None)
    monkeypatch.setattr(pipeline, "discover", discover)
    calibrate(episodes, cell(), replace(CONFIG, discover=True, false_alarm=alpha))
    assert asked == [alpha]


def raising(error: Exception) -> Callable[..., Discovery]:
    def discover(*_: object) -> Discovery:
        raise error

    return discover


@pytest.mark.parametrize(
    ("step", "error", "verdict", "says"),
    [
        ("discover", DataError("only 3 shots were found"), "not_evaluated", "only 3 shots were found"),
        ("discover", np.linalg.LinAlgError("Singular matrix"), "fit_failed", "Singular matrix"),
        ("refine", np.linalg.LinAlgError("Singular matrix"), "fit_failed", "no solution"),
        ("refine", DataError("the episodes say nothing"), "not_evaluated", "the episodes say nothing"),
    ],
)
def test_a_search_that_cannot_be_done_leaves_the_calibration(
    episodes: list[Episode],
    result: Result,
    monkeypatch: pytest.MonkeyPatch,
    step: str,
    error: Exception,
    verdict: str,
    says: str,
) -> None:
    monkeypatch.setattr(pipeline, "refine", lambda *_: None)
    monkeypatch.setattr(pipeline, step, raising(error))
    ended, _ = calibrate(episodes, cell(), replace(CONFIG, discover=True))
    assert found(ended) == found(result)
    assert (ended.mismatch.verdict, "\n" in ended.mismatch.sentence) == (verdict, False)
    assert says in ended.mismatch.sentence


@pytest.mark.parametrize(
    ("other", "said", "kept"),
    [
        ({"time_step": 0.00025}, "simulated with time steps of 0.25 ms", {"time_step_s": 0.00025}),
        ({"holds": True}, "simulated with dry friction that holds", {"friction_holds": True}),
    ],
)
def test_with_other_numerics_all_is_done_anew(
    episodes: list[Episode],
    result: Result,
    monkeypatch: pytest.MonkeyPatch,
    other: dict[str, Any],
    said: str,
    kept: dict[str, Any],
) -> None:
    """Its fit is that of the other simulator, its gaps too, and what is written says so."""
    cells: list[Cell] = []

    def discover(simulator: Simulator, *_: object) -> Discovery:
        cells.append(simulator.cell)
        if len(cells) > 1:
            return not_evaluated("it was asked")
        return fit_failed("another is better", replace(simulator.cell, **other))

    monkeypatch.setattr(pipeline, "refine", lambda *_: None)
    monkeypatch.setattr(pipeline, "discover", discover)
    ended, found_last = calibrate(episodes, cell(), replace(CONFIG, discover=True))
    assert cells == [cell(), replace(cell(), **other)]
    assert found_last.mismatch.verdict == ended.mismatch.verdict == "not_evaluated"
    assert ended.warnings[0].startswith(said)
    assert (ended.gap["nominal"] == result.gap["nominal"]) is ("holds" in other)  # no joint has friction there
    assert kept.items() <= to_json(ended).items()
    assert not kept.keys() & to_json(result).keys()
    assert to_json(from_json(to_json(ended))) == to_json(ended)


@pytest.mark.parametrize("error", [RuntimeError("a bug"), KeyboardInterrupt(), MemoryError()])
def test_what_was_calibrated_is_handed_out_before_the_search(
    episodes: list[Episode], result: Result, monkeypatch: pytest.MonkeyPatch, error: Exception
) -> None:
    """Whatever ends the search, a bug, the user or the machine: nothing that was computed is lost."""
    kept: list[Result] = []
    monkeypatch.setattr(pipeline, "refine", lambda *_: None)
    monkeypatch.setattr(pipeline, "discover", raising(error))
    with pytest.raises(type(error)):
        calibrate(episodes, cell(), replace(CONFIG, discover=True), keep=lambda r, _: kept.append(r))
    assert found(kept[0]) == found(result)
    assert kept[0].gap == result.gap
    assert kept[0].mismatch.verdict == "not_evaluated"
    assert "the search has not ended" in kept[0].mismatch.sentence


def test_a_stop_is_said(episodes: list[Episode]) -> None:
    def stop(progress: Progress) -> bool:
        return False

    assert calibrate(episodes, cell(), CONFIG, stop)[0].cancelled


def test_what_an_effect_makes_unsure_is_not_called_identifiable(episodes: list[Episode]) -> None:
    own, alone = cell(), simulator()
    half = np.array([p.half_width for p in own.parameters])
    sure = np.ones(len(half), dtype=bool)
    estimate = Estimate("causal-map", own.defaults, 0.01 * half, sure, None, (), 0, True, "done")
    beside = not_evaluated("nobody asked")
    unsure = np.where(np.arange(len(half)) == 3, 0.6, 0.1) * half
    data = recordings(own, episodes[:2])
    noise = measure_noise(data.time_s, data.measured, own.spec.noise_m)

    def identifiable(found: Discovery) -> list[bool]:
        result = assemble(own, CONFIG, Posed(alone, data, data, noise), False, estimate, found)
        return [row.identifiable for row in result.parameters]

    assert all(identifiable(beside))
    beside = replace(beside, parameters=own.defaults, std=unsure)
    assert identifiable(beside) == (np.arange(len(half)) != 3).tolist()


def test_the_floor_is_of_positions_as_the_error_is() -> None:
    """A cube's orientation has noise too, in another unit; `Gap.rmse_m` does not count it."""
    push = load("push_i")
    assert [o.quantity for o in push.objects] == ["pose"]
    sigma = np.array([1e-3, 2e-3, 2e-3, 0.1, 0.1, 0.1, 0.1])
    assert noise_floor(push, Noise(sigma, 0.0)) == pytest.approx(3e-3)
    assert noise_floor(cell(), Noise(np.array([3e-3, 4e-3, 3e-3, 4e-3]), 0.0)) == pytest.approx(5e-3)


def test_a_launch_that_differs_from_its_command_is_no_error_of_the_simulator() -> None:
    """An arm that repeats its speed to 3 % and its angle to 0.02 rad, in front of a simulator that is right."""
    own = cell()
    own = replace(own, spec=replace(own.spec, launch_noise={"velocity": 0.015, "angle": 0.02}))
    arm, commanded = Simulator(own, threads=2), actions(4, seed=9)
    rng = np.random.default_rng(1)
    true = commanded + own.launch_std * rng.normal(size=commanded.shape)
    stamps = START + np.round(np.arange(-0.5, 2.5, 1 / 60) * 1e9).astype(np.int64)
    seen = arm.observe(values({}, 4), true, np.tile((stamps - START) * 1e-9, (4, 1)))
    seen = seen + rng.normal(0, NOISE, seen.shape)
    shots = [
        Episode(
            f"shot{i}", own.name, own.hash, dict(zip(FIELDS, commanded[i].tolist(), strict=True)), START,
            tuple(Track(f"puck{k + 1}", "xy", stamps, seen[i][:, 2 * k : 2 * k + 2]) for k in range(2)),
        )
        for i in range(4)
    ]  # fmt: skip
    data = recordings(own, shots)
    noise = measure_noise(data.time_s, data.measured, own.spec.noise_m)
    floor = noise_floor(own, noise)
    assert Replay(arm, data).gap(own.defaults).rmse_m > 10 * floor
    fitted = launched(arm, data, noise, own.defaults)
    assert fitted.gap(own.defaults).rmse_m < 1.05 * floor
    error = (fitted.inputs - true)[:, own.launch_std > 0] / own.launch_std[own.launch_std > 0]
    assert np.abs(error).max() < 0.3
    assert np.array_equal(launched(simulator(), data, noise, own.defaults).inputs, data.inputs)  # launches are exact

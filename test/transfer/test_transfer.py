"""Rounds and campaigns with tiny budgets leave what they promise; the same seed gives the same rows."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import cast

import numpy as np
import pytest

from compass_ros.cells import load
from compass_ros.errors import ConfigError
from compass_ros.policy import Belief, belief, one, pushing
from compass_ros.policy.augmented import augmented
from compass_ros.policy.residual import Ensemble, Residual
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import Attached, effect
from compass_ros.simulation.extents import unit_body
from compass_ros.simulation.replay import Recordings
from compass_ros.transfer import campaign, table
from compass_ros.transfer.experiment import air_hockey, push_i
from compass_ros.transfer.loop import LoopConfig, run_loop

TASK = air_hockey()


@pytest.mark.nightly
def test_a_loop_leaves_policies_bags_and_rounds(tmp_path: Path) -> None:
    config = LoopConfig("uniform", rounds=1, recordings=4, fresh=2, rollouts=64, judged=3)
    rows = run_loop(TASK, "low", config, tmp_path, threads=1)
    assert json.loads((tmp_path / "rounds.json").read_text()) == rows
    assert [r["recordings"] for r in rows] == [4, 6]
    assert all((tmp_path / f"round_{i}" / "policy.npz").is_file() for i in (0, 1))
    assert len(list((tmp_path / "bags").iterdir())) == 4 + 2 * 2
    assert run_loop(TASK, "low", config, tmp_path / "again", threads=1) == rows
    with pytest.raises(ConfigError, match="no recordings in 'low-heavy'"):
        run_loop(TASK, "low-heavy", config, tmp_path)


def test_a_campaign_goes_on_where_it_was(tmp_path: Path) -> None:
    file, plan = tmp_path / "rows.jsonl", campaign.Plan(("nominal",), ("low", "high", "low-moved"), 1, 4, 64)
    assert campaign.compare(TASK, plan, file, tmp_path, 1) == 2
    assert campaign.run(TASK, plan, file, tmp_path, 1) == 3
    with file.open("a") as lines:
        lines.write('{"torn')
    assert campaign.run(TASK, plan, file, tmp_path, 1) == campaign.compare(TASK, plan, file, tmp_path, 1) == 0
    low, high, moved = (r for r in campaign.read(file) if r["seed"] == 0)
    assert low["action"] == high["action"] != moved["action"]
    assert "as it was drawn" in table.tables(campaign.read(file))


@pytest.mark.nightly
def test_a_policy_over_time_is_trained_played_and_kept(tmp_path: Path) -> None:
    task = push_i()
    belief_ = one(Simulator(task.cell, threads=1, options={"timestep": 0.001}), task.cell.defaults)
    rows = [campaign.over_time(task, belief_, "real", "nominal", tmp_path, 0, transitions=64) for _ in range(2)]
    assert {k: v for k, v in rows[0].items() if not k.startswith("trained")} == {
        k: v for k, v in rows[1].items() if not k.startswith("trained")
    }
    assert (tmp_path / "policy-nominal-real-0.npz").is_file()
    assert 0 <= float(str(rows[0]["success"])) <= 1


def test_a_tool_begins_elsewhere_in_a_changed_condition() -> None:
    task = push_i()
    belief_ = one(Simulator(task.cell, threads=1, options={"timestep": 0.001}), task.cell.defaults)
    across = task.across["real-moved"]
    assert task.changed["real-moved"] == "real"
    assert task.over_time is not None
    for bars in (pushing.Simulated(belief_, 4, 0, 0.0), task.over_time(4, 0)):
        np.testing.assert_allclose(
            bars.reset(np.full(4, across))[1][:, 1], across, atol=5e-3
        )  # the arm's repeatability is 1 mm
        for _ in range(4):  # pushed beside its middle, the bar turns away from the target's angle
            now, _ = bars.step(np.tile([0.2, 0.0], (4, 1)))
        assert np.all(now[:, 2] < -0.02)
    assert pushing.TARGET[2] > 0


@pytest.mark.nightly
def test_a_network_of_control_steps_learns_how_a_bar_turns() -> None:
    task = push_i()
    cell, simulator = task.cell, Simulator(task.cell, threads=1, options={"timestep": 0.001})
    true = cell.defaults.copy()
    true[cell.index("bar@dyna@centre_y")] += 0.002
    rng, time_s = np.random.default_rng(0), np.tile(np.arange(96) / 60, (12, 1))
    inputs = simulator.inputs(task.commands(12, 0))
    truth = simulator.observe(np.tile(true, (12, 1)), inputs, time_s)
    seen = truth + 1e-4 * rng.standard_normal(truth.shape)
    seen[3, 40:43] = np.nan
    steps_s = cell.control_dt * np.arange(cell.horizon + 1)
    data = Recordings((), inputs, time_s, seen, steps_s, np.empty(0), np.empty(0), np.empty(0))
    plain = one(simulator, cell.defaults)
    networked = augmented(plain, data, cell.control_dt, 0)
    other, at = task.commands(12, 7), steps_s[:-1]
    real = simulator.observe(np.tile(true, (12, 1)), simulator.inputs(other), np.tile(at, (12, 1)))

    def missed(belief: Belief) -> float:
        return float(np.linalg.norm(belief.observe(other, at, rng)[..., :2] - real[..., :2]))

    assert missed(networked) < 0.6 * missed(plain)
    still = replace(networked, left=cast(Ensemble, lambda features: np.zeros((len(features), 3))))
    np.testing.assert_allclose(still.observe(other, at, rng), plain.observe(other, at, rng), atol=1e-9)


def test_a_belief_is_kept_with_its_laws_and_its_shares(tmp_path: Path) -> None:
    plain = Simulator(TASK.cell, threads=1)
    patched = plain.with_effects([Attached(effect("friction_patch"), ("puck1", "puck2"))])
    values = np.concatenate([plain.defaults, [0.3, 0.0, 0.0, 0.2]])
    two = belief.Belief((*one(plain, plain.defaults).cases, *one(patched, values).cases))
    belief.save(two, tmp_path / "two.json")
    again, command = belief.load(tmp_path / "two.json", plain), TASK.commands(8, 0)
    said = [b.observe(command, np.array([1.0]), np.random.default_rng(3)) for b in (two, again)]
    np.testing.assert_array_equal(said[0], said[1])
    alone = [one(c.simulator, c.values).observe(command, np.array([1.0]), np.random.default_rng(0)) for c in two.cases]
    assert {int(np.argmin([np.abs(a[i] - said[0][i]).max() for a in alone])) for i in range(8)} == {0, 1}


@pytest.mark.parametrize("centred", [False, True])
def test_a_law_that_has_its_numbers_from_the_scene_is_kept(centred: bool, tmp_path: Path) -> None:
    plain = Simulator(load("pushed_bar"), threads=1)
    payload = effect("payload").at(unit_body(centred=centred))
    simulator = plain.with_effects([Attached(payload, ("bar",))])
    values = np.concatenate([plain.defaults, [0.02, 0.0002, 0.0, 0.0][: len(payload.quantities)]])
    belief.save(one(simulator, values), tmp_path / "laws.json")
    (again,) = belief.load(tmp_path / "laws.json", plain).cases
    assert again.simulator.effects[0].effect.quantities[0].unit == "kg"
    np.testing.assert_array_equal(again.values, values[None])


@pytest.mark.nightly
def test_a_residual_network_learns_an_offset() -> None:
    rng = np.random.default_rng(0)
    command, time_s = rng.uniform(size=(10, 2)), np.linspace(0, 1, 20)
    said = np.cumsum(rng.normal(size=(10, 20, 2)), axis=1)
    network = Residual(command, time_s, said, said + 0.1 * command[:, :1, None], 0)
    other = rng.uniform(0.2, 0.8, size=(5, 2))
    fresh = np.cumsum(rng.normal(size=(5, 20, 2)), axis=1)
    missed = network(other, time_s, fresh) - fresh - 0.1 * other[:, :1, None]
    assert np.abs(missed).mean() < 0.5 * 0.1 * other[:, 0].mean()

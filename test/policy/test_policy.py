"""Agents on shots: rewards by hand, a known best action, the same bits from the same seed, the command."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml

from compass_ros.cells import load
from compass_ros.errors import ConfigError
from compass_ros.policy import Goal, Shots, one, sac, train
from compass_ros.simulation import Simulator
from compass_ros.types import Floats, Progress
from test.conftest import Run
from test.operation.results import write_calibration

CELL = load("air_hockey")
GOAL = Goal("puck2", (0.43, 0.0), 0.15)
RNG = np.random.default_rng(0)
BEST = np.array([0.5, -0.4, 0.2, 0.6])


def shots(goal: Goal = GOAL) -> Shots:
    simulator = Simulator(CELL, threads=1)
    return Shots(CELL, one(simulator, simulator.defaults), goal)


class Known(Shots):
    """Shots whose best action is known."""

    def distances(self, actions: Floats, rng: np.random.Generator) -> Floats:
        return np.asarray(np.linalg.norm(actions - BEST, axis=1))


def known() -> Known:
    simulator = Simulator(CELL, threads=1)
    return Known(CELL, one(simulator, simulator.defaults), GOAL)


def test_the_reward_falls_with_the_distance_and_has_a_prize_for_the_goal() -> None:
    assert GOAL.reward(np.array([0.0, 0.1, 0.2])) == pytest.approx([2.25, 1.75, -1.0])


def test_actions_span_the_cells_action_space() -> None:
    ends = shots().command(np.array([[-1.0] * 4, [1.0] * 4, [3.0] * 4]))
    assert ends[0] == pytest.approx([a.low for a in CELL.action])
    assert ends[1] == pytest.approx([a.high for a in CELL.action])
    assert ends[2] == pytest.approx(ends[1])


def test_the_distance_is_that_of_the_last_position() -> None:
    given, action = shots(), np.array([[0.1, 0.2, 0.3, 0.4]])
    simulator = Simulator(CELL, threads=1)
    path = simulator.observe(simulator.defaults[None], given.command(action), np.linspace(0, CELL.duration, 9)[None])
    assert given.distances(action, RNG)[0] == pytest.approx(np.hypot(*(path[0, -1, 2:] - GOAL.centre)))


def test_what_the_agent_sees_are_the_first_positions() -> None:
    assert shots().start == pytest.approx([-0.15, 0.0, -0.075, -0.075], abs=1e-6)


def test_a_sure_hand_repeats_its_shot() -> None:
    judged = known().judge(BEST + 0.05, 0.0, seed=0, count=5)
    assert judged.success == 1.0
    assert judged.distance == pytest.approx(0.1)
    assert known().judge(BEST, 0.2, seed=0).success < 1.0


@pytest.mark.nightly
@pytest.mark.slow
def test_an_agent_finds_the_best_action() -> None:
    given = known()
    found = train(given, seed=1).action()
    assert given.distances(found[None], RNG)[0] < 0.25 < 0.5 * np.linalg.norm(BEST)


@pytest.mark.slow
def test_the_same_seed_gives_the_same_agent() -> None:
    one, two, other = (train(known(), 640, seed).action() for seed in (3, 3, 4))
    np.testing.assert_array_equal(one, two)
    assert np.any(one != other)


def test_training_ends_when_it_is_asked_to() -> None:
    seen: list[float] = []

    def watch(progress: Progress) -> bool:
        seen.append(progress.done)
        return len(seen) < 3

    train(known(), 1280, 0, watch)
    assert len(seen) == 3


@pytest.mark.parametrize(
    ("goal", "message"),
    [
        (Goal("puck3", (0.4, 0.0), 0.1), "no object 'puck3'; did you mean 'puck"),
        (Goal("puck2", (0.4, 0.0, 0.8), 0.1), "goal: expected 2 numbers"),
    ],
)
def test_wrong_goals_are_refused(goal: Goal, message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        shots(goal)


@pytest.mark.slow
def test_the_command(run: Run, tmp_path: Path) -> None:
    result = write_calibration(tmp_path / "result", CELL, {"puck1@dyna@friction_sliding": 0.03})
    words = ("--rollouts", 640, "--threads", 1, "--out", tmp_path / "out")
    status, output, error = run("policy", result, *words)
    assert (status, error) == (0, "")
    assert "trained in" in output
    content = yaml.safe_load((tmp_path / "out" / "policy.yaml").read_text())
    assert set(content["action"]) == {"x", "y", "angle", "velocity"}
    assert set(content["judged_in_the_calibrated_simulator"]) == {"nominal", "calibrated"}
    assert (tmp_path / "out" / "policy.npz").is_file()
    assert run("policy", result, "--goal", "1,b")[2].startswith("compass: --goal: expected numbers with commas")


class Walk:
    """A point that goes to 0.6 in four steps: what is left at the end is the reward, and its sign is seen."""

    seen, chosen, count, horizon = 2, 1, 32, 4

    def __init__(self) -> None:
        self.rng = np.random.default_rng(0)

    def reset(self) -> Floats:
        self.at, self.time = self.rng.uniform(-0.5, 0.5, self.count), 0
        return self.look()

    def look(self) -> Floats:
        return np.stack([self.at, np.full(self.count, 0.25 * self.time)], axis=1)

    def step(self, actions: Floats) -> tuple[Floats, Floats]:
        self.at, self.time = self.at + 0.5 * actions[:, 0], self.time + 1
        return self.look(), -np.abs(self.at - 0.6) if self.time == self.horizon else np.zeros(self.count)


@pytest.mark.nightly
def test_a_policy_over_time_reaches_its_goal(tmp_path: Path) -> None:
    policy = sac.learn(Walk(), 3200, 0)
    policy.save(tmp_path / "policy.npz")
    again, walk = sac.read(tmp_path / "policy.npz"), Walk()
    seen = walk.reset()
    for _ in range(4):
        seen, reward = walk.step(again.act(seen))
    assert -reward.mean() < 0.1

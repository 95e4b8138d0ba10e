"""COMPASS on planted causes: the graph finds them, the gap closes, and the contract of the step holds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from compass_ros.calibration.compass import compass
from compass_ros.config import CompassConfig
from compass_ros.types import Estimate, Floats, Ints, Progress, Report, silent
from test.calibration.planted import Planted, planted

SMALL = CompassConfig(
    n_round=2, n_sim=24, n_epochs=60, emb_dim=8, causal_dim=8, hidden_dim=(32,), patience_epochs=0, batch_size=32
)
FAST = replace(
    SMALL, n_round=1, n_sim=48, n_epochs=200, learning_rate=0.005, graph_learning_rate=0.03, sparse_weight=0.01
)
FACTORS = ("a", "b")


def run(world: Planted, config: CompassConfig, seed: int = 0, report: Report = silent) -> Estimate:
    start = np.zeros(len(world.parameters))
    return compass(world.differences, world.actions, world.parameters, FACTORS, start, config, seed, report)


@pytest.mark.nightly
@pytest.mark.parametrize(("noise", "seed"), [(0.05, 1)])
def test_finds_eight_causes_among_sixty_four_and_closes_the_gap(noise: float, seed: int) -> None:
    world = planted(64, 8, noise=noise, seed=seed)
    found = run(world, CompassConfig(n_round=1), seed)
    kept = found.graph.psi >= found.graph.threshold if found.graph else np.zeros_like(world.edges)
    right = int((kept & world.edges).sum())
    assert right / kept.sum() >= 0.8, "precision"
    assert right / world.edges.sum() >= 0.8, "recall"
    assert found.trace[-1].difference.mean() < 0.2 * found.trace[0].difference.mean()
    assert found.rollouts == 10 + 640 + 10


@pytest.mark.slow
def test_decoys_are_dropped_and_keep_their_values() -> None:
    world = planted(12, 3, seed=2)
    found = run(world, FAST)
    causes = world.edges.any(axis=1)
    assert found.identifiable[causes].all()
    assert found.identifiable[~causes].mean() < 0.2
    assert np.all(found.values[~found.identifiable] == 0.0)
    assert found.trace[-1].difference.mean() < 0.6 * found.trace[0].difference.mean()


def test_the_same_seed_gives_the_same_bits_and_another_seed_does_not() -> None:
    world, short = planted(6, 2), replace(SMALL, n_epochs=10)
    first, again, other = run(world, short, 1), run(world, short, 1), run(world, short, 2)
    assert first.values.tobytes() == again.values.tobytes()
    assert first.graph is not None
    assert again.graph is not None
    assert first.graph.psi.tobytes() == again.graph.psi.tobytes()
    assert first.values.tobytes() != other.values.tobytes()


def test_values_never_leave_their_bounds() -> None:
    world = planted(4, 4, seed=3)
    asked: list[Floats] = []

    def spy(values: Floats, episodes: Ints) -> Floats:
        asked.append(values)
        return world.differences(values, episodes)

    narrow = tuple(replace(p, low=-0.3, high=0.3, half_width=0.25) for p in world.parameters)
    found = compass(spy, world.actions, narrow, FACTORS, np.zeros(4), SMALL, 0, silent)
    everything = np.concatenate(asked)
    assert everything.min() >= -0.3
    assert everything.max() <= 0.3
    assert abs(found.values).max() == pytest.approx(0.3, abs=0.06)  # the truth is outside: pushed towards the bound


def test_stops_at_the_threshold_before_spending_more() -> None:
    world = planted(4, 2, seed=4)
    first = float(run(world, replace(SMALL, n_round=1, n_epochs=5)).trace[0].difference.mean())
    assert run(world, replace(SMALL, n_round=1, n_epochs=5, stop_gap_m=0.99 * first)).rollouts > 10
    stopped = run(world, replace(SMALL, stop_gap_m=100.0))
    assert stopped.rollouts == 10
    assert stopped.converged
    assert "at or below 100 m" in stopped.stop_reason


def test_cancelling_returns_what_there_is() -> None:
    world = planted(6, 2)
    seen: list[Progress] = []

    def report(progress: Progress) -> bool:
        seen.append(progress)
        return progress.iteration < 2

    found = run(world, SMALL, report=report)
    assert found.stop_reason.startswith("cancelled in iteration 2")
    assert not found.converged
    assert [p.done for p in seen] == sorted(p.done for p in seen)
    assert found.values.tobytes() == min(found.trace, key=lambda t: float(t.difference.mean())).values.tobytes()


@pytest.mark.nightly
def test_a_factor_that_never_differs_has_no_edge() -> None:
    world = planted(4, 2, seed=5)

    def one_factor(values: Floats, episodes: Ints) -> Floats:
        d = world.differences(values, episodes)
        d[:, 1] = 0.0
        return d

    config = replace(SMALL, n_epochs=200, n_round=1)
    found = compass(one_factor, world.actions, world.parameters, FACTORS, np.zeros(4), config, 0, silent)
    assert found.graph is not None
    assert (found.graph.psi[:, 1] < 0.5).all()

"""Every method behind the interface: it closes a gap that it can close, pays for what it uses, and stops when told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.methods import METHODS, method
from compass_ros.calibration.problem import Allowance, Problem
from compass_ros.calibration.rivals import network, npdr
from compass_ros.errors import ConfigError
from compass_ros.types import Floats, Ints, Progress, silent
from test.calibration.planted import Planted, planted

RIVALS = ["npdr", "exi-net", "tune-net", "mujoco-sysid", "cma-es", "random"]
SMALL = Allowance(iterations=3, real=4, sim=20)


class Meter:
    """A planted world as a problem that counts its rollouts."""

    def __init__(self, world: Planted) -> None:
        self.world, self.rollouts = world, 0
        measured = world.measured()
        weight = np.full(measured.shape, 100.0)
        weight[1, 3:9] = 0.0  # the tracker lost the object there
        likelihood = Likelihood(
            predict=lambda values, inputs, time: np.zeros((len(values), time.shape[1], measured.shape[2])),
            parameters=world.parameters,
            inputs=world.actions,
            time_s=np.tile(np.linspace(0, 1, measured.shape[1]), (len(measured), 1)),
            measured=np.where(weight > 0, measured, np.nan),
            sigma=np.full(measured.shape, 0.01),
            correlation_time=1.0,
            launch_std=np.zeros(world.actions.shape[1]),
            prior_mean=np.zeros(len(world.parameters)),
            prior_std=np.ones(len(world.parameters)),
        )
        self.problem = Problem(
            differences=self.differences,
            trajectories=self.trajectories,
            measured=np.where(weight > 0, measured, 123.0),  # must not be looked at
            weight=weight,
            actions=world.actions,
            parameters=world.parameters,
            factors=("a", "b"),
            start=np.zeros(len(world.parameters)),
            simulated_seconds=1.0,
            apart=lambda one, other: np.abs(one - other),
            distance=lambda values: 0.0,
            likelihood=likelihood,
        )

    def differences(self, values: Floats, episodes: Ints) -> Floats:
        self.rollouts += len(values)
        return self.world.differences(values, episodes)

    def trajectories(self, values: Floats, episodes: Ints) -> Floats:
        self.rollouts += len(values)
        return self.world.trajectories(values, episodes)


@pytest.fixture(autouse=True)
def short_trainings(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(network, "EPOCHS", 120)
    monkeypatch.setattr(network, "HIDDEN", (32, 32))
    for name, value in {"FEATURES": 16, "TRANSFORMS": 2, "EPOCHS": 40, "SAMPLES": 16, "WARMUP": 2}.items():
        monkeypatch.setattr(npdr, name, value)


@pytest.mark.nightly
@pytest.mark.parametrize("name", RIVALS)
def test_a_rival_closes_the_gap_pays_and_repeats(name: str) -> None:
    meter = Meter(planted(3, 3, episodes=4, seed=1))
    found = METHODS[name].run(meter.problem, SMALL, 5, silent)
    assert found.method == name
    assert found.rollouts == meter.rollouts, "what it says it spent is what it spent"
    assert found.rollouts <= 1.35 * SMALL.rollouts  # the allowance and the measurements of the trace
    assert [t.rollouts for t in found.trace] == sorted(t.rollouts for t in found.trace)
    before = float(found.trace[0].difference.mean())
    after = float(meter.problem.mean_differences(found.values[None]).mean())
    assert after < {"npdr": 0.9, "mujoco-sysid": 0.05}.get(name, 0.75) * before
    low, high = meter.problem.low, meter.problem.high
    assert np.all((found.values >= low) & (found.values <= high))
    again = METHODS[name].run(Meter(planted(3, 3, episodes=4, seed=1)).problem, SMALL, 5, silent)
    assert found.values.tobytes() == again.values.tobytes()


@pytest.mark.parametrize("name", RIVALS)
def test_a_rival_stops_when_told(name: str) -> None:
    meter = Meter(planted(3, 2, episodes=4))
    seen: list[Progress] = []

    def stop(progress: Progress) -> bool:
        seen.append(progress)
        return False

    found = METHODS[name].run(meter.problem, SMALL, 0, stop)
    assert found.stop_reason == "cancelled"
    assert not found.converged
    assert len(seen) == 1


def test_least_squares_gives_the_planted_truth_and_honest_deviations() -> None:
    world = replace(planted(3, 3, episodes=6, seed=2), noise=0.01)
    found = METHODS["mujoco-sysid"].run(Meter(world).problem, replace(SMALL, iterations=20), 0, silent)
    pull = (found.values - world.truth) / found.std
    assert np.all(np.abs(pull) < 4)
    assert np.all(found.std < 0.05)


def test_least_squares_is_not_hindered_by_recordings_without_noise() -> None:
    """Its regularizer has absolute limits, so its residual must not be in units of a vanishing noise."""
    meter = Meter(planted(3, 3, episodes=6, seed=2))
    given = meter.problem
    rough = METHODS["mujoco-sysid"].run(given, SMALL, 0, silent)
    exact = METHODS["mujoco-sysid"].run(replace(given, weight=given.weight * 1e7), SMALL, 0, silent)
    assert exact.rollouts == rough.rollouts
    np.testing.assert_allclose(exact.values, rough.values, rtol=1e-9)


def test_an_unknown_method_names_the_nearest() -> None:
    with pytest.raises(ConfigError, match=r"unknown method 'cma'; available: .*did you mean 'cma-es'\?"):
        method("cma")

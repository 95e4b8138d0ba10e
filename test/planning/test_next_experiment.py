"""The next experiment, for models that were fitted to the same three shots."""

from __future__ import annotations

import numpy as np
import pytest

from compass_ros.discovery.hypothesis import Hypothesis
from compass_ros.planning.next_experiment import NextExperiment, next_experiment
from compass_ros.simulation.effects import EFFECTS, Attached
from test.discovery.planted import PUCKS, model, planned_response
from test.simulation.table import cell, simulator


def rival(name: str, *numbers: float) -> Hypothesis:
    objects = PUCKS if EFFECTS[name].moves else ()
    return model(planned_response(), Attached(EFFECTS[name], objects), numbers)


def ask(*rivals: Hypothesis) -> NextExperiment:
    return next_experiment(simulator(), rivals, seed=0, count=8)


@pytest.fixture(scope="module")
def forces() -> tuple[Hypothesis, Hypothesis]:
    return rival("viscous_drag", 0.2), rival("magnus", 0.2)


@pytest.fixture(scope="module")
def found(forces: tuple[Hypothesis, Hypothesis]) -> NextExperiment:
    return ask(*forces)


def test_it_is_a_shot_within_reach_said_in_words(found: NextExperiment) -> None:
    assert found.action is not None
    assert [*found.action] == ["x", "y", "angle", "velocity"]
    for value, (low, high) in zip(found.action.values(), cell().reach, strict=True):
        assert low <= value <= high
    for word in (
        f"x {found.action['x']:.3f} m",
        f"velocity {found.action['velocity']:.3f} m/s",
        "viscous_drag",
        "magnus",
    ):
        assert word in found.sentence


def test_the_models_differ_in_that_shot(forces: tuple[Hypothesis, Hypothesis], found: NextExperiment) -> None:
    """The whole difference, in sigma of one millimetre, is at least what remains after the models adapt."""
    assert found.action is not None
    shot, time = np.array([[*found.action.values()]]), np.linspace(0, 2.5, 60)[None]
    one, other = (r.simulator.observe(r.fit.point.values[None], shot, time) for r in forces)
    assert found.apart > 5
    assert np.linalg.norm((one - other) / 1e-3) >= found.apart


def test_the_same_seed_gives_the_same_shot(forces: tuple[Hypothesis, Hypothesis], found: NextExperiment) -> None:
    assert ask(*forces) == found


def test_where_no_shot_helps_another_experiment_is_named() -> None:
    """A late camera and a late arm shift the pucks alike in every shot."""
    found = ask(rival("camera_latency", 0.01), rival("actuation_delay", 0.01))
    assert found.action is None
    assert "No shot tells camera_latency from actuation_delay" in found.sentence
    assert "encoders" in found.sentence


def test_of_three_models_the_pair_that_stays_is_named(forces: tuple[Hypothesis, Hypothesis]) -> None:
    found = ask(forces[0], rival("camera_latency", 0.01), rival("actuation_delay", 0.01))
    assert found.action is not None
    assert "viscous_drag(puck1, puck2) from camera_latency" in found.sentence
    assert "No shot tells camera_latency from actuation_delay" in found.sentence


def test_what_helps_several_pairs_is_said_once() -> None:
    """Three errors of a camera that are zero: every shot looks the same to all of them."""
    found = ask(rival("camera_latency", 0.0), rival("clock_drift", 0.0), rival("camera_scale", 0.0, 0.0, 0.0, 0.0))
    assert found.sentence.startswith("No shot tells camera_latency, clock_drift and camera_scale apart: put a puck")
    assert found.sentence.count("No shot") == 1


def test_one_model_needs_no_experiment(forces: tuple[Hypothesis, Hypothesis]) -> None:
    assert ask(forces[0]) == NextExperiment("")

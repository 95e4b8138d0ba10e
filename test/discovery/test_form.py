"""A lesser law is physics of its own, or stands for what the form of a larger one lacks."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from compass_ros.calibration.cost import Point, cost
from compass_ros.calibration.differences import linearise
from compass_ros.calibration.least_squares import Fit
from compass_ros.discovery import form
from compass_ros.discovery.fits import without
from compass_ros.discovery.form import told_apart
from compass_ros.discovery.hypothesis import Hypothesis, name_of, widened
from compass_ros.discovery.odds import Known, Prior, Weighed
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import Attached, effect
from compass_ros.simulation.sizes import unit_joint
from test.simulation import robots

SPRING = 0.4


def on(joint: str, name: str) -> Attached:
    return Attached(effect(name).at(unit_joint("hinge")), (joint,))


def fitted(folder: Path, laws: list[Attached], numbers: list[float], beyond: float) -> Hypothesis:
    """The model of two swinging joints that has the laws, at their true numbers; what is recorded also has `beyond`."""
    cell = robots.robot(folder, ("hinge", "hinge"), step_ms=2.0)
    plain, inputs = Simulator(cell, threads=1), robots.shots(cell, 4)
    likelihood = robots.recorded(plain, [*laws, on("j0", "viscous_drag")], [*numbers, beyond], inputs)
    simulator, likelihood = widened(plain, likelihood, laws)
    point, free = Point(np.array([*plain.defaults, *numbers]), np.zeros_like(inputs), 0.0), []
    at = len(plain.defaults)
    for law in laws:
        free += [at + i for i in np.flatnonzero(law.amplitudes)]
        at += len(law.amplitudes)
    chosen = np.array([0, *free])
    linear = linearise(likelihood, point, chosen, np.full(len(chosen), 0.01))
    point = replace(point, cost=float(cost(likelihood, [point], 1e6)[0][0]))
    model = Hypothesis(tuple(laws), simulator, likelihood, Fit(point, linear, chosen, 1e6, 0, True))
    return Hypothesis(model.laws, simulator, likelihood, model.fit, without(model, laws).fit.linear.residual)


def known(*models: Weighed) -> Known:
    prior = Prior({"spring": 1, "cogging": 1})
    return Known(prior, 0.0, {model.name: (model, odds) for model, odds in models}, set())


def physics(model: Hypothesis, least: float = -1.0) -> list[str]:
    ((said, odds),) = told_apart(known((model, 0.0)), least)
    assert odds == 0.0
    assert {*said.physics, *said.corrections} == set(model.laws)
    return [name_of([a]) for a in said.physics]


@pytest.mark.parametrize(
    ("small", "joint", "beyond", "named"),
    [
        (0.02, "j0", 2e-3, ["spring(j0)"]),
        (0.4, "j0", 2e-3, ["spring(j0)", "cogging(j0)"]),
        (0.05, "j1", 2e-3, ["spring(j0)", "cogging(j1)"]),
        (0.02, "j1", 2e-3, ["spring(j0)"]),
        (0.02, "j0", 0.0, ["spring(j0)", "cogging(j0)"]),
        (1e-5, "j0", 0.0, ["spring(j0)"]),
    ],
    ids=[
        "a rest of its form",
        "as large",
        "on another joint",
        "slight on all joints",
        "all that is left",
        "nothing was left",
    ],
)
def test_a_law_is_named_for_what_it_changes_in_some_signal(
    tmp_path: Path, small: float, joint: str, beyond: float, named: list[str]
) -> None:
    laws = [on("j0", "spring"), on(joint, "cogging")]
    numbers = {"stiffness": SPRING, "cosine": 0.0, "sine": small}
    values = [numbers.get(q.name, q.start) for law in laws for q in law.effect.quantities]
    model = fitted(tmp_path, laws, values, beyond)
    assert physics(model) == named
    assert len(physics(model, least=1.0)) == 2  # what is improbable is not looked at


def test_models_that_name_the_same_are_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    laws = [on("j0", "spring"), on("j0", "cogging")]
    numbers = {"stiffness": SPRING, "cosine": 0.0, "sine": 0.02}
    values = [numbers.get(q.name, q.start) for law in laws for q in law.effect.quantities]
    both = fitted(tmp_path, laws, values, 2e-3)
    alone = without(both, laws[1:])
    models = (both, 3.0), (alone, 1.0)
    ((said, odds),) = told_apart(known(*models), -9.0)
    assert said.corrections == (laws[1],)
    assert said.laws == both.laws
    assert odds == pytest.approx(np.logaddexp(3.0, 1.0))
    monkeypatch.setattr(form, "RHO", (0.0, 1e-3))  # the number that decides
    assert [m.name for m, _ in told_apart(known(*models), -9.0)] == [both.name, alone.name]

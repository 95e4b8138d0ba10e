"""Another law in the place of one that was found first, from where the fit with that one stands."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from compass_ros.calibration.cost import Point
from compass_ros.calibration.least_squares import minimise
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.discovery.candidates import candidates
from compass_ros.discovery.hypothesis import Hypothesis, widened
from compass_ros.discovery.odds import Known, Prior
from compass_ros.discovery.swaps import swap, taken_out
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import Attached
from test.simulation import robots


def test_the_law_that_is_there_takes_the_place_of_one_that_does_nearly_the_same(tmp_path: Path) -> None:
    cell = robots.robot(tmp_path, ("hinge", "hinge"))
    plain, inputs = Simulator(cell, threads=1), robots.shots(cell, 4)
    asked = candidates(plain, plain.defaults, inputs, np.tile(np.linspace(0, 0.5, 20), (len(inputs), 1)))
    of = {(c.name, c.attached.objects): c.attached for c in asked}
    likelihood = robots.recorded(plain, [of["viscous_drag", ("j1",)]], [0.02], inputs)
    noise = np.random.default_rng(0).normal(0, 1, likelihood.measured.shape) * likelihood.sigma
    model = fitted(plain, robots.noisy(likelihood, noise), of["quadratic_drag", ("j1",)])

    less = taken_out(model, "quadratic_drag")
    tangent, push = model.response.tangent, model.response.accelerations(model.laws[0], model.fit.point.values[1:])
    back = less.residual + (less.pushes @ push.reshape(len(inputs), -1)[:, :, None])[..., 0]
    assert back == pytest.approx(tangent.residual)
    assert less.parameters.shape[2] == tangent.parameters.shape[2] - 1
    assert np.linalg.norm(less.residual) > 2 * np.linalg.norm(tangent.residual)

    known = Known(Prior.of(asked), 0.0, {}, set())
    known.take([model])
    swap(known, model, asked)
    best, odds = known.ordered[0]
    assert best.name == "viscous_drag(j1)"
    assert best.fit.point.values[1] == pytest.approx(0.02, rel=0.1)
    assert odds > known.models[model.name][1] + 10


def fitted(plain: Simulator, likelihood: Likelihood, law: Attached) -> Hypothesis:
    simulator, wider = widened(plain, likelihood, [law])
    values = np.array([*plain.defaults, *(q.scale for q in law.effect.quantities)])
    start = Point(values, np.zeros_like(likelihood.inputs), np.inf)
    fit = minimise(wider, start, np.arange(len(values)), 30, 1e6, 0.01)
    return Hypothesis((law,), simulator, wider, fit, np.zeros_like(likelihood.measured))

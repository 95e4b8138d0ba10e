"""What a finer time step explains is no evidence for anything; drag is no numerics."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from compass_ros.calibration.cost import start
from compass_ros.calibration.differences import linearise
from compass_ros.calibration.least_squares import Fit
from compass_ros.cells import load
from compass_ros.discovery.evidence import Tangent, evidences
from compass_ros.discovery.hypothesis import Hypothesis
from compass_ros.discovery.nuisances import finite_step, nuisances
from compass_ros.discovery.numerics import numerics_as_model
from compass_ros.discovery.planned import perfect
from compass_ros.discovery.response import Response
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import EFFECTS, Attached
from compass_ros.simulation.manifold import apart, charted
from compass_ros.simulation.numerics import CONTACTS
from test.discovery.planted import CALM, PUCKS, RATE, SIGMA, recorded, response_of
from test.discovery.servo import NOISE, servo
from test.simulation.table import cell, simulator


def cause(response: Response) -> str:
    plain = Hypothesis((), response.simulator, response.likelihood, response.fit)
    return numerics_as_model(plain, plain.free.log - plain.free.alone)


def without_nuisances(response: Response) -> Tangent:
    """The tangent with the parameters alone."""
    kept = len(response.inside)
    tangent = response.tangent
    return replace(tangent, parameters=tangent.parameters[:, :, :kept], away=tangent.away[:kept])


@pytest.mark.parametrize(
    ("options", "softness", "noise"),
    [
        ({"timestep": 0.5}, {}, 0.01),
        ({"timestep": 0.125}, {}, 0.1),
        ({}, {CONTACTS: 0.6}, 0.01),
    ],
)
def test_other_numerics_call_for_nothing(
    options: Mapping[str, float], softness: Mapping[str, float], noise: float
) -> None:
    """A finer time step, stiffer contacts."""
    clean = perfect(simulator(), CALM, RATE, noise * SIGMA)
    scene = {name: share * getattr(simulator().options, name) for name, share in options.items()}
    other = Simulator(cell(), options=scene, softness=softness)
    measured = other.observe(np.tile(simulator().defaults, (len(CALM), 1)), CALM, clean.time_s)
    response = response_of(replace(clean, measured=measured))
    plain, blind = Hypothesis((), response.simulator, response.likelihood, response.fit), without_nuisances(response)
    assert plain.free.log - plain.free.alone < 0
    assert evidences(response.tangent, [None])[0].log > evidences(blind, [None])[0].log + 5


def test_friction_that_holds_where_the_engine_creeps_calls_for_nothing(tmp_path: Path) -> None:
    """MuJoCo's dry friction is soft, nature's is not."""
    creeps = Simulator(servo(tmp_path, dry=0.3), threads=1)
    steps = np.random.default_rng(1).uniform(-1.2, 1.2, (6, 2))
    clean = perfect(creeps, steps, 60.0, NOISE)
    holds = Simulator(creeps.cell, threads=1, softness={"axis": 0.0})
    measured = holds.observe(np.tile(creeps.defaults, (len(steps), 1)), steps, clean.time_s)
    likelihood, free = replace(clean, measured=measured), np.arange(2)
    point = start(likelihood, creeps.defaults)
    fit = Fit(point, linearise(likelihood, point, free, np.full(2, 1e-3)), free, 1e6, 0, True)
    plain = Hypothesis((), creeps, likelihood, fit)
    tangent, blind = plain.response.tangent, without_nuisances(plain.response)
    assert tangent.parameters.shape[2] == len(tangent.away) == 5
    assert plain.free.log < plain.free.alone
    assert evidences(tangent, [None])[0].log > evidences(blind, [None])[0].log + 5
    np.testing.assert_allclose(tangent.parameters[..., -1], -tangent.residual, atol=1e-9)


def test_missing_drag_is_no_numerics() -> None:
    assert cause(response_of(recorded(Attached(EFFECTS["viscous_drag"], PUCKS), [0.3]))) == ""


def test_the_time_step_turns_an_orientation_by_an_angle() -> None:
    """A cube that falls on a corner: half the step turns it by the angle between both orientations, twice over."""
    cube = load("cube_toss")
    coarse = Simulator(cube, threads=1)
    inputs = np.zeros((1, len(cube.input_names)))
    inputs[0, :10] = [0, 0, 0.07, 1, 0, 0, 0, 0.5, 0, -1.5]
    inputs[0, 10:13] = [3.0, -5.0, 4.0]
    seen = perfect(coarse, coarse.inputs(inputs), 148.0, SIGMA)
    likelihood = replace(seen, measured=charted(cube, seen.measured), difference=partial(apart, cube))
    point, free = start(likelihood, coarse.defaults), np.arange(2)
    fit = Fit(point, linearise(likelihood, point, free, np.full(2, 1e-3)), free, 4.0, 0, True)
    finer = Simulator(cube, threads=1, options={"timestep": 0.5 * coarse.time_step})
    turned = finer.observe(coarse.defaults[None], likelihood.inputs, likelihood.time_s)[0, :, 3:7]
    from_, to = (Rotation.from_quat(q, scalar_first=True) for q in (seen.measured[0, :, 3:7], turned))
    angle = (from_.inv() * to).magnitude()
    found = SIGMA * finite_step(coarse, likelihood, fit)[0, :, 3:7]
    assert angle.max() > 1e-3
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 2 * angle, atol=1e-9)
    step, contacts, friction = np.moveaxis(nuisances(coarse, likelihood, fit), -1, 0)
    np.testing.assert_allclose(SIGMA * step[0, :, 3:7], found, atol=1e-12)
    assert not contacts.any(), "this cell tunes them itself"
    assert not friction.any()


def test_contacts_and_their_friction_are_unsure() -> None:
    bar = load("pushed_bar")
    plain = Simulator(bar, threads=1)
    clean = perfect(plain, np.array([[0.01, 0.2, 0.02, 0.2, -0.02]]), 60.0, SIGMA)
    likelihood = replace(clean, measured=charted(bar, clean.measured), difference=partial(apart, bar))
    point, free = start(likelihood, plain.defaults), np.arange(1)
    fit = Fit(point, linearise(likelihood, point, free, np.full(1, 1e-3)), free, 4.0, 0, True)
    _, contacts, friction = np.moveaxis(SIGMA * nuisances(plain, likelihood, fit)[..., :2, :], -1, 0)
    assert 1e-4 < np.abs(contacts).max() < 5e-3
    assert 1e-4 < np.abs(friction).max() < 5e-3

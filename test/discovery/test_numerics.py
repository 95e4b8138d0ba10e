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
from compass_ros.calibration.least_squares import Fit, minimise
from compass_ros.cells import load
from compass_ros.discovery.evidence import Tangent
from compass_ros.discovery.hypothesis import Hypothesis
from compass_ros.discovery.nuisances import finite_step, nuisances, stated_errors
from compass_ros.discovery.numerics import friction_that_holds, numerics_as_model, shorter_step
from compass_ros.discovery.response import Response
from compass_ros.discovery.sized import sized
from compass_ros.planning.planned import perfect
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
    """The tangent with the parameters and launches alone."""
    kept, own = len(response.inside), response.launches.shape[2]
    tangent = response.tangent
    return replace(
        tangent,
        parameters=tangent.parameters[:, :, :kept],
        away=tangent.away[:kept],
        own=tangent.own[:, :, :own],
        own_away=tangent.own_away[:, :own],
    )


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
    assert sized(response.tangent, [None])[0].log > sized(blind, [None])[0].log + 5


def test_a_contact_falls_into_a_step_by_chance() -> None:
    """An engine whose steps fall otherwise in each shot calls for nothing; with one number for all shots it would."""
    clean = perfect(simulator(), CALM, RATE, 0.1 * SIGMA)
    shots = []
    for share, shot, time in zip((0.5, 1.5, 0.5), CALM, clean.time_s, strict=True):
        other = Simulator(cell(), options={"timestep": share * simulator().options.timestep})
        shots.append(other.observe(simulator().defaults[None], shot[None], time[None])[0])
    response = response_of(replace(clean, measured=np.stack(shots)))
    plain, tangent = Hypothesis((), response.simulator, response.likelihood, response.fit), response.tangent
    launches = response.launches.shape[2]
    common = replace(tangent, own=tangent.own[:, :, :launches], own_away=tangent.own_away[:, :launches])
    assert plain.free.log - plain.free.alone < 0
    assert sized(tangent, [None])[0].log > sized(common, [None])[0].log + 1000


def with_step(step: float, by: Simulator) -> Hypothesis:
    """Shots as another simulator plays them, and the table's simulator at its defaults with steps of its own."""
    simulator = Simulator(replace(cell(), time_step=step), threads=1)
    clean = perfect(simulator, CALM, RATE, 0.1 * SIGMA)
    laws = np.zeros(sum(len(a.effect.quantities) for a in by.effects)) + 0.3
    values = np.tile(np.append(simulator.defaults, laws), (len(CALM), 1))
    likelihood, free = replace(clean, measured=by.observe(values, CALM, clean.time_s)), np.arange(2)
    point = start(likelihood, simulator.defaults)
    return Hypothesis(
        (), simulator, likelihood,
        Fit(point, linearise(likelihood, point, free, np.full(2, 1e-3)), free, 4.0, 0, True),
    )  # fmt: skip


def test_a_step_that_is_too_long_is_said() -> None:
    """Shots with steps of the scene, played with steps four times as long: the scene's would do; beside a drag none."""
    step = Simulator(cell()).time_step
    long, best = with_step(4 * step, Simulator(cell(), threads=1)), 100.0
    assert long.fit.point.cost > 10 * best
    finer = shorter_step(long, best, 5.0)
    assert finer
    assert finer.time_step == pytest.approx(step)
    assert shorter_step(long, 10 * long.fit.point.cost, 5.0) is None
    dragged = Simulator(cell(), [Attached(EFFECTS["viscous_drag"], PUCKS)], threads=1)
    drag = with_step(step, dragged)
    assert shorter_step(drag, 0.5 * drag.fit.point.cost, 5.0) is None


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
    assert sized(tangent, [None])[0].log > sized(blind, [None])[0].log + 5
    np.testing.assert_allclose(tangent.parameters[..., -1], -tangent.residual, atol=1e-9)


@pytest.mark.parametrize("holds", [False, True])
def test_friction_that_holds_is_taken_where_it_held(tmp_path: Path, holds: bool) -> None:
    """To first order a nuisance explains it, so nothing is missing; what is predicted is still a joint that creeps."""
    own = servo(tmp_path, dry=0.3)
    simulator, played = Simulator(own, threads=1), Simulator(replace(own, holds=holds), threads=1)
    steps = np.random.default_rng(1).uniform(-1.2, 1.2, (6, 2))
    clean = perfect(simulator, steps, 60.0, NOISE)
    seen = played.observe(np.tile([1.2, 1.1] * simulator.defaults, (len(steps), 1)), steps, clean.time_s)
    likelihood = replace(clean, measured=seen + np.random.default_rng(2).normal(0, NOISE, seen.shape))
    fit = minimise(likelihood, start(likelihood, simulator.defaults), np.arange(2), 20, 1e6)
    plain = Hypothesis((), simulator, likelihood, fit)
    assert (plain.chi_square > 10) is holds
    assert friction_that_holds(plain, 4.6) == (replace(own, holds=True) if holds else None)


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
    found = SIGMA * finite_step(coarse, likelihood, point, fit.linear.residual)[0, :, 3:7]
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


def test_a_sensors_stated_error_is_one_function_of_the_place() -> None:
    """Components sum to a process of the stated variance, alike where the same place is seen again, and smooth."""
    rng = np.random.default_rng(0)
    once = rng.uniform(-0.5, 0.5, (5, 40, 4))
    likelihood = perfect(simulator(), CALM, RATE, SIGMA)
    measured = np.concatenate([once, once], axis=1)
    seen = replace(likelihood, measured=measured, sigma=np.full(measured.shape, SIGMA))
    assert stated_errors(cell(), seen).shape == (*measured.shape, 0)
    columns = stated_errors(cell(), replace(seen, systematic=np.array([2 * SIGMA, 0.0, SIGMA, SIGMA])))
    np.testing.assert_allclose(columns[:, :40], columns[:, 40:], atol=1e-9)
    size = np.sqrt(np.sum(columns**2, axis=-1))
    np.testing.assert_allclose(size, np.broadcast_to([2, 0, 1, 1], size.shape), rtol=0.1)
    own = np.flatnonzero(np.any(columns[..., 2, :] != 0, axis=(0, 1)))
    assert not np.any(columns[:, :, [0, 1, 3]][..., own])
    bend = (once[..., 2] ** 2 + once[..., 3] ** 2) * once[..., 2]
    functions = columns[:, :40, 2, own].reshape(-1, len(own))
    left = bend.ravel() - functions @ np.linalg.lstsq(functions, bend.ravel(), rcond=None)[0]
    assert left.std() < 0.1 * bend.std()


@pytest.mark.parametrize(("stated", "called_for"), [(0.0, True), (1.0, False)])
def test_what_a_sensor_states_of_itself_calls_for_nothing(stated: float, called_for: bool) -> None:
    """A lens as small as the error that a tracker states of its frame, seen through a tenth of that from frame to
    frame."""
    lens = Attached(EFFECTS["lens_distortion"], ())
    planted = recorded(lens, [30 * q.scale if q.amplitude else q.start for q in lens.effect.quantities])
    plain = recorded(None, [])
    moved = planted.measured - plain.measured
    error = float(np.sqrt(np.nanmean(moved**2)))
    sensed = replace(plain, measured=plain.measured + moved, sigma=np.full(plain.sigma.shape, SIGMA))
    response = response_of(replace(sensed, systematic=stated * error * np.ones(moved.shape[2])))
    found = Hypothesis((), simulator(), response.likelihood, response.fit).free
    assert error > 2 * SIGMA
    assert (found.log - found.alone > 10) == called_for

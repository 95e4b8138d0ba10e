"""Verdicts on a servo by one measure: what no law of the library is, two laws, and how often noise is taken for one."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from compass_ros.calibration.cost import Point
from compass_ros.calibration.differences import linearise
from compass_ros.calibration.least_squares import Fit
from compass_ros.calibration.noise import Noise
from compass_ros.config import CalibrationConfig
from compass_ros.discovery import discover
from compass_ros.discovery.candidates import candidates
from compass_ros.discovery.first_order import FirstOrder
from compass_ros.discovery.fits import from_parent, whole
from compass_ros.discovery.hypothesis import Hypothesis
from compass_ros.discovery.neighbours import exchange, rank
from compass_ros.discovery.odds import Known, Prior
from compass_ros.discovery.search import Found, search
from compass_ros.discovery.threshold import BEYOND, largest_odds, simulated
from compass_ros.pipeline import calibrate
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import Attached, Effect, Quantity, effect
from compass_ros.simulation.effects.effect import Context
from compass_ros.simulation.native.program import Kind, Term
from compass_ros.types import Floats
from test.discovery.servo import on_axis, recorded, servo
from test.simulation import robots


def _gust(numbers: Floats, context: Context) -> tuple[Term, ...]:
    return tuple(Term(Kind.HAT, site, np.insert(numbers, 1, 0.0, axis=1)) for site in context.sites)


GUST = Effect(
    name="gust",
    channel="dynamics",
    quantities=(
        Quantity("force", "N m", -10.0, 10.0, 0.1),
        Quantity("moment", "s", 0.0, 10.0, 1.0, amplitude=False),
        Quantity("half_width", "s", 0.01, 10.0, 1.0, amplitude=False, start=0.1),
    ),
    sentence="a gust",
    on=("hinge", "slide"),
    forces=_gust,
)
"""A push at one moment of each recording: no law of the library depends on time."""


@pytest.mark.slow
def test_a_push_at_a_moment_is_unknown_and_on_its_joint(tmp_path: Path) -> None:
    cell = servo(tmp_path)
    episodes = recorded(cell, [Attached(GUST, ("axis",))], [0.15, 0.7, 0.12])
    mismatch = calibrate(episodes, cell, CalibrationConfig(threads=1))[0].mismatch
    assert mismatch.verdict == "unknown", mismatch.sentence
    assert mismatch.where is not None
    assert mismatch.where.channel == "dynamics"
    assert mismatch.explanations[0].laws[0].name == "unknown"
    if "the best law" in mismatch.sentence:
        assert re.search(r"has [\w ]*[\d.]+, held-out error with it [\d.]+ mrad", mismatch.sentence)
    assert sum(e.probability for e in mismatch.explanations) == pytest.approx(1.0, abs=1e-3)


def plain(folder: Path, seed: int) -> Hypothesis:
    """An arm that swings, with white noise, at the fit of a simulator that lacks nothing."""
    cell = robots.robot(folder, ("hinge", "hinge"), step_ms=2.0)
    simulator, inputs = Simulator(cell, threads=1), robots.shots(cell, 4)
    likelihood = robots.recorded(simulator, [], [], inputs)
    noise = np.random.default_rng(seed).normal(0, 1, likelihood.measured.shape) * likelihood.sigma
    noisy = robots.noisy(likelihood, noise)
    point, free = Point(simulator.defaults, np.zeros_like(inputs), 0.0), np.arange(len(simulator.parameters))
    linear = linearise(noisy, point, free, np.full(len(free), 0.01))
    return Hypothesis((), simulator, noisy, Fit(point, linear, free, 4.0, 0, True))


def test_noise_seldom_exceeds_the_threshold(tmp_path: Path) -> None:
    """Largest odds of sixty recordings without anything missing: as the bootstrap of the first of them says."""
    model = plain(tmp_path, 0)
    likelihood = model.likelihood
    asked = candidates(model.simulator, model.response.values, likelihood.inputs, likelihood.time_s)
    first, prior = rank(FirstOrder(model.response), asked), Prior.of(asked)
    white = Noise(np.ones(likelihood.measured.shape[2]), 0.0)
    priors = [prior.of_laws([f.candidate.name]) for f in first]
    odds = largest_odds(model.response, first, priors, white, 0.01, 0)
    assert odds.shape == (100 * BEYOND,)
    assert np.mean(odds > 0) < 0.01
    again = largest_odds(model.response, first, priors, white, 0.01, 0)
    assert np.array_equal(odds, again)
    for alpha in (0.3, 0.1, 0.05, 0.02, 0.004):
        rarer = largest_odds(model.response, first, priors, white, alpha, 0)
        assert rarer.shape == (round(BEYOND / alpha),)
        assert np.allclose(rarer[:200], odds[: len(rarer)])
        assert np.sum(rarer > np.quantile(rarer, 1 - alpha)) == BEYOND
    found = search(model, first, asked, lambda *_: True)
    assert found.probabilities[0] > 0.9


def test_prior_odds_are_shared_by_names_and_then_by_sites(tmp_path: Path) -> None:
    model = plain(tmp_path, 1)
    asked = candidates(model.simulator, model.response.values, model.likelihood.inputs, model.likelihood.time_s)
    prior = Prior.of(asked)
    total = sum(count * np.exp(prior.of_laws([name])) for name, count in prior.sites.items())
    assert total == pytest.approx(0.5)
    assert prior.of_laws(["spring", "spring"]) == prior.of_laws(["spring"])
    assert prior.of_laws(["spring", "coulomb_friction"]) == pytest.approx(
        prior.of_laws(["spring"]) + prior.of_laws(["coulomb_friction"])
    )


def test_recordings_of_an_encoder_are_simulated_in_whole_steps(tmp_path: Path) -> None:
    """Fitted motion less error is a multiple of a step from a common zero; white noise where nothing counts."""
    model, step = plain(tmp_path, 2), 2e-3
    likelihood, linear = model.likelihood, model.fit.linear
    shape = likelihood.measured.shape
    counts = Noise(np.full(shape[2], step / np.sqrt(12)), 0.0, np.full(shape[2], step))
    error = simulated(model.response, counts, np.random.default_rng(0)) * likelihood.sigma
    read = likelihood.measured + linear.residual * likelihood.sigma - error
    for column in range(shape[2]):
        phase = read[..., column] / step
        turns = np.exp(2j * np.pi * phase)
        assert abs(turns.mean()) > 0.999999
    assert np.abs(error).max() <= step
    white = simulated(model.response, Noise(np.ones(shape[2]), 0.0), np.random.default_rng(0))
    assert white.std() == pytest.approx(1.0, abs=0.05)


@pytest.mark.nightly
def test_a_law_that_stood_for_another_is_exchanged(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Dry friction and a delay of the command are missing; a drag was taken first, and the delay beside it."""
    cell = servo(tmp_path)
    given: list[tuple[Any, ...]] = []
    laws = [on_axis("coulomb_friction"), Attached(effect("actuation_delay"), ())]
    episodes = recorded(cell, laws, [0.08, 0.0, 0.03])

    def kept(*asked: Any) -> Found:
        given.append(asked)
        return search(*asked)

    monkeypatch.setattr(sys.modules[discover.__module__], "search", kept)
    calibrate(episodes, cell, CalibrationConfig(threads=1))
    plain, _, asked, *_ = given[0]

    def grown(parent: Hypothesis, name: str) -> Hypothesis:
        first = next(r for r in rank(FirstOrder(parent.response), asked) if r.candidate.name == name)
        return whole(parent, from_parent(parent, first, np.arange(len(parent.likelihood.inputs)), 4))

    wrong = grown(grown(plain, "quadratic_drag"), "actuation_delay")
    unmatched = Known(Prior.of(asked), plain.free.alone, {}, set())
    unmatched.take([wrong])
    exchange(unmatched, asked, {plain.name}, unknown=1.0, least=np.inf)
    left = {a.effect.name for model, _ in unmatched.ordered for a in model.laws}
    assert left == {"quadratic_drag", "actuation_delay"}  # no other law could reach what is asked for
    known = Known(Prior.of(asked), plain.free.alone, {}, set())
    known.take([wrong])
    exchange(known, asked, {plain.name}, unknown=1.0, least=-np.inf)
    best, odds = known.ordered[0]
    assert {a.effect.name for a in best.laws} == {"coulomb_friction", "actuation_delay"}
    assert odds > known.models[wrong.name][1] + 10

"""What a fit at the noise floor does not predict is noticed; what it predicts raises no alarm."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.noise import Noise
from compass_ros.calibration.refine import refine
from compass_ros.cells import load
from compass_ros.discovery.choice import PREDICTS, Choice
from compass_ros.discovery.choose import simplest
from compass_ros.discovery.joint import Joint
from compass_ros.discovery.unseen import HELD_OUT_SEEN, Prediction, held_out, unexpected
from compass_ros.posing import pose
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import EFFECTS, Attached
from compass_ros.simulation.replay import Recordings
from test.discovery.planted import HELD_OUT, PUCKS, SIGMA, joint, recorded, space_of
from test.simulation.table import cell, simulator

RIVALS = (Attached(EFFECTS["magnus"], PUCKS), Attached(EFFECTS["quadratic_drag"], PUCKS))
PENDULUM = load(Path(__file__).parents[2] / "examples" / "own_cell" / "pendulum.yaml")
DRAG = Attached(EFFECTS["viscous_drag"], PUCKS)


@pytest.mark.slow
def test_only_shots_on_another_table_are_unexpected() -> None:
    refined = refine(recorded(None, []), simulator().defaults)
    assert refined.chi_square < 1.2
    assert not unexpected(recorded(None, [], HELD_OUT, 1), refined)
    assert unexpected(recorded(DRAG, [0.3], HELD_OUT, 1), refined)


def test_a_wall_that_no_fitted_shot_met_is_held_against_no_model() -> None:
    """One held-out shot meets the back wall, whose damping is another; of the bar, the fitted shots knew."""
    space = space_of(recorded(None, []))
    back, bar = (held_out(damped(name), space.likelihood, space.fit) for name in ("back_wall", "obstacle"))
    for unseen in (back, bar):
        assert [cell().parameters[i].name for i in unseen.untaught.which] == ["back_wall@dyna@damping"]
    assert back.excess < HELD_OUT_SEEN
    assert bar.excess > 20 * HELD_OUT_SEEN


def damped(name: str) -> Likelihood:
    """The held-out shots on a table where one thing springs back harder."""
    clean = recorded(None, [], HELD_OUT)
    values = np.tile(cell().values({f"{name}@dyna@damping": -6.0}), (len(HELD_OUT), 1))
    measured = simulator().observe(values, HELD_OUT, clean.time_s)
    return replace(clean, measured=measured + np.random.default_rng(1).normal(0, SIGMA, measured.shape))


def test_what_predicts_only_a_part_helps_and_is_not_named() -> None:
    """Half of the true drag leaves a quarter of the surprise."""
    space = space_of(recorded(DRAG, [0.3]))
    unseen = held_out(recorded(DRAG, [0.3], HELD_OUT, 1), space.likelihood, space.fit)
    whole, half = joint(space, DRAG, [0.3]), costing(joint(space, DRAG, [0.15]), 30.0)
    choice = Choice((whole, half), None, excess=1000.0, floor=0.0)  # both explain the fitted episodes
    assert unseen.share(whole) == pytest.approx(1.0, abs=0.02)
    assert unseen.share(half) == pytest.approx(0.75, abs=0.1)
    assert unseen.helps(whole)
    assert unseen.helps(half)
    assert choice.nameable(whole, unseen)
    assert not choice.nameable(half, unseen)


def test_what_leaves_a_little_is_named_where_no_other_explains_much() -> None:
    space = space_of(recorded(DRAG, [0.3]))
    unseen = held_out(recorded(DRAG, [0.3], HELD_OUT, 1), space.likelihood, space.fit)
    whole = costing(joint(space, DRAG, [0.3]), 100.0)
    weak, strong = (tuple(costing(joint(space, rival, [0.01]), left) for rival in RIVALS) for left in (900.0, 300.0))
    choice = Choice((whole, *weak), None, excess=1000.0, floor=0.0)
    assert choice.nameable(whole, unseen)
    assert not replace(choice, singles=(whole, *strong)).nameable(whole, unseen), "others leave 300, it leaves 100"


def test_what_is_unsure_of_its_numbers_predicts_nothing_though_nothing_refutes_it() -> None:
    """Both excuse the held-out shots; the best numbers of one do no better there than no effect."""
    space = space_of(recorded(DRAG, [0.3]))
    unseen = held_out(recorded(DRAG, [0.3], HELD_OUT, 1), space.likelihood, space.fit)
    sure, unsure = joint(space, DRAG, [0.3]), joint(space, DRAG, [0.01])
    excused = Prediction(unseen.prediction(sure).surprise, unseen.prediction(unsure).missed)
    unseen = replace(unseen, _asked={sure: unseen.prediction(sure), unsure: excused})
    assert unseen.share(unsure) == unseen.share(sure) > PREDICTS
    assert unseen.helps(sure)
    assert not unseen.helps(unsure)


def test_what_explains_all_that_was_fitted_and_fails_on_the_others_was_not_taught() -> None:
    space = space_of(recorded(DRAG, [0.3]))
    whole = joint(space, DRAG, [0.3])
    same, other = (
        held_out(recorded(effect, [size], HELD_OUT, 1), space.likelihood, space.fit)
        for effect, size in ((DRAG, 0.3), (RIVALS[0], 0.5))
    )
    choice = Choice((whole,), None, excess=1000.0, floor=0.0)
    assert choice.complete()
    assert not replace(choice, singles=(costing(whole, 30.0),)).complete(), "0.07 of chi-square are left to find"
    assert choice.untaught(other)
    assert not choice.untaught(same)
    assert not replace(choice, singles=(costing(whole, 300.0),)).untaught(other), "the fitted ones have more to teach"


def test_an_excess_that_noise_may_have_made_refutes_nothing() -> None:
    space = space_of(recorded(DRAG, [0.3]))
    unseen = held_out(recorded(DRAG, [0.3], HELD_OUT, 1), space.likelihood, space.fit)
    weak, scatter = joint(space, DRAG, [0.15]), np.sqrt(unseen.likelihood.measurements / 2)
    before = unseen.surprise(weak) + 1.0
    beyond, within = (
        replace(unseen, plain=Prediction(before, unseen.plain.missed), floor=before - times * scatter)
        for times in (3.0, 1.5)
    )
    assert 0 < beyond.share(weak) < PREDICTS
    assert not beyond.helps(weak)
    assert within.excess > HELD_OUT_SEEN
    assert within.share(weak) == 1.0
    assert within.helps(weak)


def test_a_wind_so_fast_that_it_is_a_tilt_is_no_rival_of_the_tilt() -> None:
    tilt, wind = Attached(EFFECTS["table_tilt"], PUCKS), Attached(EFFECTS["crosswind"], PUCKS)
    space = space_of(recorded(tilt, [1e-3, -2e-3]))
    unseen = held_out(recorded(tilt, [1e-3, -2e-3], HELD_OUT, 1), space.likelihood, space.fit)
    true = costing(joint(space, tilt, [1e-3, -2e-3]), 100.0)
    weak = tuple(costing(joint(space, rival, [0.01]), 900.0) for rival in RIVALS)
    same, better = (costing(joint(space, wind, [5e-3, -1e-2, 3.0]), left) for left in (99.0, 5.0))
    choice = Choice((true, *weak), None, excess=1000.0, floor=0.0)
    assert choice.nameable(true, unseen)
    assert replace(choice, singles=(same, true, *weak)).nameable(true, unseen)
    assert simplest([same, true]) is true
    assert not replace(choice, singles=(better, true, *weak)).nameable(true, unseen), "the wind explains more"
    assert simplest([better, true]) is better


def costing(fitted: Joint, cost: float) -> Joint:
    return replace(fitted, fit=replace(fitted.fit, point=replace(fitted.fit.point, cost=cost)))


def swings(numbers: tuple[float, ...], seed: int) -> Likelihood:
    """Swings of the documentation's pendulum whose first states are known as its YAML says; with quadratic drag."""
    rng = np.random.default_rng(seed)
    effects = [Attached(EFFECTS["quadratic_drag"], ("swing",))] if numbers else []
    plain = Simulator(PENDULUM, threads=1)
    wider = plain.with_effects(effects)
    times = np.tile(np.arange(180) / 60, (6, 1))
    seen_at = np.column_stack([rng.uniform(-1.2, 1.2, 6), rng.uniform(-1, 1, 6)])
    true = seen_at + rng.normal(0, 1, seen_at.shape) * PENDULUM.launch_std
    measured = wider.observe(np.tile(np.concatenate([plain.defaults, numbers]), (6, 1)), true, times)
    measured = measured + rng.normal(0, 0.001, measured.shape)
    said, std = np.array([-np.inf]), np.zeros(seen_at.shape[1])
    data = Recordings(tuple("abcdef"), seen_at, times, measured, times[0], measured, said, std)
    return pose(plain, data, Noise(np.array([0.001]), 0.0)).likelihood


@pytest.mark.slow
def test_first_states_that_nobody_knew_well_are_no_surprise() -> None:
    refined = refine(swings((), 0), Simulator(PENDULUM, threads=1).defaults)
    assert refined.chi_square < 1.2
    fitted, fit = refined.likelihood, refined.fit
    fine, dragged = (held_out(swings(numbers, 1), fitted, fit) for numbers in ((), (0.1,)))
    assert abs(fine.excess) < HELD_OUT_SEEN
    assert not unexpected(swings((), 1), refined)
    assert dragged.excess > 20 * HELD_OUT_SEEN
    assert unexpected(swings((0.1,), 1), refined)

"""A law that is within its error bars of zero goes; of two that do nearly the same one stays."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from compass_ros.calibration.cost import start
from compass_ros.calibration.least_squares import minimise
from compass_ros.discovery.hypothesis import Hypothesis, widened
from compass_ros.discovery.neighbours import join
from compass_ros.discovery.odds import Known, Prior
from compass_ros.discovery.search import finish
from compass_ros.discovery.zero import Zero
from compass_ros.simulation.effects import Attached, effect
from compass_ros.simulation.sizes import unit_joint
from compass_ros.types import Floats
from test.discovery.planted import PUCKS, asked_of_table, recorded, response_of


def test_of_two_laws_that_do_the_same_one_stays() -> None:
    """Each is unsure beside the other, so that neither is more than two error bars from zero; together they are."""
    laws = [Attached(effect(name), PUCKS) for name in ("viscous_drag", "quadratic_drag")]
    plain = response_of(recorded(laws[0], [0.035]))
    likelihood, free = plain.likelihood, plain.fit.free
    simulator, wider = widened(plain.simulator, likelihood, laws)
    everything = np.concatenate([free, np.arange(len(likelihood.parameters), len(wider.parameters))])
    fit = minimise(wider, start(wider, wider.prior_mean), everything, 20, 4.0)
    both = Hypothesis(tuple(laws), simulator, wider, fit, without=plain.fit.linear.residual)
    assert [both.zero.may_lack([law]) for law in laws] == [True, True]
    assert not both.zero.may_lack(laws)
    alone = Hypothesis((), plain.simulator, likelihood, plain.fit).free.alone
    known = Known(Prior.of(asked_of_table()), alone, {both.name: (both, 0.0)}, set())
    finish(known, (-50.0,))
    assert len(known.models) == 1
    ((left, _),) = known.models.values()
    assert len(left.laws) == 1
    assert left.zero.weakest == ()


def test_what_slides_in_one_plane_has_a_law_in_common() -> None:
    """A law that came to each puck by itself is one law with one size, where it is the same; and that costs less."""
    laws = [Attached(effect("viscous_drag"), (puck,)) for puck in PUCKS]
    plain = response_of(recorded(Attached(effect("viscous_drag"), PUCKS), [0.2]))
    simulator, wider = widened(plain.simulator, plain.likelihood, laws)
    everything = np.concatenate([plain.fit.free, np.arange(len(plain.likelihood.parameters), len(wider.parameters))])
    fit = minimise(wider, start(wider, wider.prior_mean), everything, 20, 4.0)
    each = Hypothesis(tuple(laws), simulator, wider, fit, without=plain.fit.linear.residual)
    alone = Hypothesis((), plain.simulator, plain.likelihood, plain.fit).free.alone
    prior = Prior.of(asked_of_table())
    odds = each.log_evidence - alone + prior.of_laws(["viscous_drag"] * 2)
    known = Known(prior, alone, {each.name: (each, odds)}, set())
    join(known, asked_of_table())
    (best, better), _ = known.ordered
    assert [a.objects for a in best.laws] == [PUCKS]
    assert better > odds
    assert best.fit.point.values[-1] == pytest.approx(0.2, abs=3 * best.std[-1])


def test_a_model_with_a_site_less_is_fitted_from_the_optimum_of_the_other() -> None:
    """Beside a fit that had not ended, a site that is at zero seemed to be worth a lot (air_hockey 1020002)."""
    laws = [Attached(effect("viscous_drag"), (puck,)) for puck in PUCKS]
    plain = response_of(recorded(laws[0], [0.2]))
    simulator, wider = widened(plain.simulator, plain.likelihood, laws)
    cells = len(plain.likelihood.parameters)
    everything = np.concatenate([plain.fit.free, cells + np.arange(2)])
    fit = minimise(wider, start(wider, wider.prior_mean), everything, 20, 4.0)
    each = Hypothesis(tuple(laws), simulator, wider, fit, without=plain.fit.linear.residual)
    one, of_one = widened(plain.simulator, plain.likelihood, laws[:1])
    begun = minimise(of_one, start(of_one, of_one.prior_mean), everything[:-1], 0, 4.0)
    less = Hypothesis((laws[0],), one, of_one, begun, without=plain.fit.linear.residual)
    alone = Hypothesis((), plain.simulator, plain.likelihood, plain.fit).free.alone
    known = Known(Prior.of(asked_of_table()), alone, {each.name: (each, 500.0), less.name: (less, -500.0)}, set())
    finish(known, (0.0,))
    assert [model.laws for model, _ in known.ordered] == [(laws[0],)]
    assert known.ordered[0][1] > 0


def test_a_site_at_zero_is_none_whatever_its_error_bars() -> None:
    own, zero = sites([5.0, 0.0, 1e-3], np.eye(3))
    assert [zero.nothing([a]) for a in own] == [False, True, False]


@pytest.mark.parametrize(("share", "ended"), [(0.5, True), (2.0, False)])
def test_a_fit_that_has_not_ended_is_not_worse_than_a_discrepancy(share: float, ended: bool) -> None:
    """The best model is brought to its optimum before it is refuted, unless no fit could come up to the discrepancy: it
    gains at most what it leaves above the noise."""
    law = Attached(effect("viscous_drag"), PUCKS)
    plain = response_of(recorded(law, [0.2]))
    simulator, wider = widened(plain.simulator, plain.likelihood, [law])
    everything = np.concatenate([plain.fit.free, np.arange(len(plain.likelihood.parameters), len(wider.parameters))])
    begun = minimise(wider, start(wider, wider.prior_mean), everything, 0, 4.0)
    model = Hypothesis((law,), simulator, wider, begun, without=plain.fit.linear.residual)
    could = model.fit.point.cost - 0.5 * wider.measurements
    assert could > 100
    alone = Hypothesis((), plain.simulator, plain.likelihood, plain.fit).free.alone
    known = Known(Prior.of(asked_of_table()), alone, {model.name: (model, 0.0)}, set())
    finish(known, (share * could,))
    assert (model.name in known.finished) is ended
    if ended:
        assert known.models[model.name][1] > share * could


def test_a_wall_that_no_shot_touches_is_left_to_others() -> None:
    """Where nothing is shown, nothing is absent. Oracle: what another offset of a wall does to the recordings."""
    drag = Attached(effect("viscous_drag"), PUCKS)
    plain = response_of(recorded(drag, [0.0]))
    laws = [Attached(effect("local_wall"), (wall,)) for wall in plain.simulator.places.walls]
    simulator, wider = widened(plain.simulator, plain.likelihood, laws)
    cells = len(plain.likelihood.parameters)
    point, amplitudes = start(wider, wider.prior_mean), np.concatenate([law.amplitudes for law in laws])
    free = np.concatenate([plain.fit.free, cells + np.flatnonzero(amplitudes)])
    model = Hypothesis(tuple(laws), simulator, wider, minimise(wider, point, free, 2, 4.0))
    shown = []
    for _, own in model.own():
        values = np.stack([wider.prior_mean] * 2)
        values[1, own.start] += 0.002
        many = [np.repeat(values[i : i + 1], len(wider.inputs), axis=0) for i in range(2)]
        seen = [simulator.observe(one, wider.inputs, wider.time_s) for one in many]
        shown.append(bool(np.nanmax(np.abs(seen[1] - seen[0]) / wider.sigma) > 1))
    assert [model.zero.shown(law) for law in laws] == shown
    assert {True, False} == set(shown)


def sites(away: Sequence[float], bars: Floats, episodes: Floats | None = None) -> tuple[list[Attached], Zero]:
    """Coulomb friction on as many joints, each with a size, and which may be zero by the noise and by the episodes."""
    own = [Attached(effect("coulomb_friction").at(unit_joint("hinge")), (f"j{i}",)) for i in range(len(away))]
    at = tuple((a, np.array([i])) for i, a in enumerate(own))
    errors = (bars, np.zeros_like(bars) if episodes is None else episodes)
    return own, Zero(at, np.array(away), errors, np.ones(len(away)))


def test_a_law_that_raced_on_all_joints_stays_where_it_is() -> None:
    own, zero = sites([5.0, 0.1, -1.4, 0.6], np.eye(4))
    assert set(zero.absent(own)) == set(own[1:])
    assert zero.weakest == ()
    assert zero.weakest_site == (own[1],)


def test_a_site_that_only_some_episodes_show_stays_for_the_evidence() -> None:
    """It is beyond the noise; that the episodes leave it open makes the law one that may be zero, and drops no site."""
    own, zero = sites([5.0, 4.0, 0.1], np.eye(3), episodes=np.diag([100.0, 100.0, 0.1]))
    assert zero.absent(own) == (own[2],)
    assert set(zero.weakest) == set(own)


def test_many_sites_that_are_each_small_may_not_all_be_zero_together() -> None:
    """Eight of 1.9 error bars each: chi-square 28.9 of 8 numbers."""
    own, zero = sites([1.9] * 8, np.eye(8))
    assert all(zero.may_lack([a]) for a in own)
    assert not zero.may_lack(own)
    assert 0 < len(zero.absent(own)) < 8


@pytest.mark.parametrize(("away", "absent"), [(0.5, 2), (6.0, 1)])
def test_two_sites_that_do_nearly_the_same_go_one_by_one(away: float, absent: int) -> None:
    """Each is unsure beside the other; their sum is known to half an error bar."""
    wide = np.array([[100.0, -99.9], [-99.9, 100.0]])
    own, zero = sites([away, away], wide)
    assert len(zero.absent(own)) == absent
    assert len(zero.weakest_site) == 1
    assert len(zero.weakest) == (2 if absent == 2 else 0)

"""What a pair of effects says of each of the two alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from compass_ros.calibration.least_squares import cost, minimise
from compass_ros.calibration.refine import refine
from compass_ros.discovery import choose
from compass_ros.discovery.beginning import begun, in_place_of
from compass_ros.discovery.candidates import Candidate
from compass_ros.discovery.choice import undecided
from compass_ros.discovery.choose import _contested, _in_its_place, _with_second
from compass_ros.discovery.joint import fit_jointly
from compass_ros.discovery.pairs import of_singles, one_of, with_contacts
from compass_ros.discovery.screen import Score
from compass_ros.discovery.unseen import held_out
from compass_ros.simulation.effects import EFFECTS, Attached
from test.discovery.planted import (
    CALM,
    HELD_OUT,
    PUCKS,
    asked_of_table,
    joint,
    planned_space,
    recorded,
    recorded_with,
    space_of,
)
from test.simulation.table import simulator

SWIRL = Attached(EFFECTS["swirl"], PUCKS)
TILT = Attached(EFFECTS["table_tilt"], PUCKS)
PLANTED = [0.03, -0.05, 0.04, 0.1, 0.5]


@pytest.mark.slow
@pytest.mark.parametrize("swirl_at", [0, 1])
def test_one_of_a_pair_that_does_nothing_can_be_left_out_and_the_other_cannot(swirl_at: int) -> None:
    space = space_of(recorded(SWIRL, PLANTED))
    nothing = np.zeros_like(space.residual)
    scores = [Score(Candidate(TILT), np.array([1e-4, 1e-4]), 1.0, nothing)]
    scores.insert(swirl_at, Score(Candidate(SWIRL), np.array(PLANTED) * [0.8, 0.9, 1.1, 1.1, 1.0], 100.0, nothing))
    pair = fit_jointly(space, scores, 4)
    swirl, tilt = one_of(pair, swirl_at, space), one_of(pair, 1 - swirl_at, space)
    assert (swirl.name, tilt.name) == ("swirl", "table_tilt")
    assert swirl.fit.point.cost < pair.fit.point.cost + 3.0
    assert tilt.fit.point.cost > 2.0 * pair.fit.point.cost
    assert swirl.fit.point.values[-5:-1] == pytest.approx(PLANTED[:4], rel=0.1)


@pytest.mark.parametrize(
    ("name", "numbers", "stands_in"),
    [
        ("fan_field", [0.02, -0.1, 0.0, 0.03, 0.5], True),
        ("fan_field", [0.02, -0.1, 0.0, 0.05, 0.5], False),
        ("friction_patch", [0.02, -0.1, 0.0, 0.25], True),
        ("friction_patch", [0.02, -0.1, 0.0, 0.15], False),
        ("stribeck_friction", [0.02, 0.35], True),
        ("stribeck_friction", [0.02, 0.2], False),
        ("table_tilt", [1e-3, 0.0], False),
    ],
)
def test_a_shape_that_is_not_what_the_name_says_stands_for_something_else(
    name: str, numbers: list[float], stands_in: bool
) -> None:
    assert joint(planned_space(), Attached(EFFECTS[name], PUCKS), numbers).stands_in == stands_in


@pytest.mark.slow
def test_what_an_impact_loses_is_found_beside_a_latency_though_dampings_take_it_away() -> None:
    latency, slope = (Attached(EFFECTS[name], ()) for name in ("camera_latency", "rate_dependent_restitution"))
    likelihood = recorded_with([latency, slope], [0.03, 0.5], np.concatenate([CALM, HELD_OUT]))
    plain = refine(likelihood, simulator().defaults)
    fit = plain.fit
    first = begun(simulator(), plain.likelihood, fit.point, fit.free, fit.robust, Candidate(latency))
    asked = [c for c in asked_of_table() if c.name in ("rate_dependent_restitution", "tangential_impulse")]
    (best,) = with_contacts(first, asked, 1.0)
    assert best.added == (latency, slope)
    assert best.fit.point.cost < first.fit.point.cost - 30.0
    assert best.fit.point.values[-2:] == pytest.approx([0.03, 0.5], rel=0.1)


@pytest.mark.slow
def test_contacts_are_asked_where_first_order_knows_no_second_effect(monkeypatch: pytest.MonkeyPatch) -> None:
    """The dampings hide what an impact loses from first order, which here suggests a tilt that does nothing."""
    latency, slope = (Attached(EFFECTS[name], ()) for name in ("camera_latency", "rate_dependent_restitution"))
    space = space_of(recorded_with([latency, slope], [0.03, 0.5], CALM))
    unseen = held_out(recorded_with([latency, slope], [0.03, 0.5], HELD_OUT, 1), space.likelihood, space.fit)
    found = joint(space, latency, [0.03])
    first = replace(found, fit=minimise(found.likelihood, found.fit.point, found.fit.free, 6, found.fit.robust))
    scores = [
        Score(Candidate(a), np.array(n), 1.0, np.zeros_like(space.residual))
        for a, n in ((latency, [0.03]), (TILT, [1e-5, 1e-5]))
    ]
    monkeypatch.setattr(choose, "promising_pairs", lambda *_: [fit_jointly(space, scores, 4)])
    asked = [c for c in asked_of_table() if c.name in ("rate_dependent_restitution", "tangential_impulse")]
    choice = _with_second(undecided(space).of([first]), asked, unseen)
    assert choice.two
    assert choice.pair is not None
    assert choice.pair.added == (latency, slope)


def test_an_effect_that_was_tried_first_does_not_hide_its_twin() -> None:
    """46 ms: far from what a small step says; fitted alone the delay is enough, and the latency was never tried."""
    latency, delay = (Attached(EFFECTS[name], ()) for name in ("camera_latency", "actuation_delay"))
    space = space_of(recorded(latency, [0.046]))
    first = in_place_of(joint(space, latency, [0.046]), delay, simulator(), space.likelihood)
    choice = undecided(space).of([first])
    asked = [Candidate(latency, (delay,)), Candidate(delay, (latency,)), Candidate(SWIRL)]
    (twin,) = _in_its_place(first, choice, space, asked)
    assert twin.added == (latency,)
    assert twin.fit.point.cost == pytest.approx(first.fit.point.cost, abs=3.0)
    assert twin.fit.point.values[-1] == pytest.approx(0.046, abs=0.002)
    assert _in_its_place(first, choice.of([first, twin]), space, asked) == []
    behind = replace(twin, fit=replace(twin.fit, point=replace(twin.fit.point, cost=twin.fit.point.cost + 10.0)))
    (again,) = _in_its_place(first, choice.of([first, behind]), space, asked)
    assert again.fit.point.cost == pytest.approx(twin.fit.point.cost, abs=1.0), "it had not converged"


def test_effects_that_may_be_named_are_compared_at_their_optimum() -> None:
    """The latency is planted, and a step short of its place the fit of its twin is the better one."""
    latency, delay = (Attached(EFFECTS[name], ()) for name in ("camera_latency", "actuation_delay"))
    space = space_of(recorded(latency, [0.046]))
    unseen = held_out(recorded(latency, [0.046], HELD_OUT, 1), space.likelihood, space.fit)
    twin = in_place_of(joint(space, latency, [0.046]), delay, simulator(), space.likelihood)
    behind = joint(space, latency, [0.043])
    reached = cost(behind.likelihood, [behind.fit.point], behind.fit.robust)[0][0]
    behind = replace(behind, fit=replace(behind.fit, point=replace(behind.fit.point, cost=float(reached))))
    choice = undecided(space).of([twin, behind])
    assert choice.good(unseen) == [twin, behind]
    ended = _contested(choice, unseen)
    assert all(j.settled for j in ended.singles)
    (found,) = (j for j in ended.singles if j.added == (latency,))
    assert found.fit.point.cost < behind.fit.point.cost - 3.0
    assert found.fit.point.values[-1] == pytest.approx(0.046, abs=0.001)
    alone = undecided(space).of([twin])
    assert _contested(alone, unseen) is alone, "nothing contests it"


@pytest.mark.slow
@pytest.mark.parametrize("leads", [True])
def test_two_effects_that_were_found_alone_are_put_together(leads: bool) -> None:
    """Each as it stands alone, the field twice as wide as it is; another effect may have explained more than either."""
    latency, true = Attached(EFFECTS["camera_latency"], ()), [0.05, -0.05, 0.04, 0.06, 0.5]
    space = space_of(recorded_with([SWIRL, latency], [*true, 0.03], np.concatenate([CALM, HELD_OUT])))
    alone = [joint(space, SWIRL, [0.03, -0.03, 0.03, 0.12, 0.5]), joint(space, latency, [0.02])]
    tilt = joint(space, TILT, [1e-3, 0.0])
    singles = [*alone, tilt] if leads else [tilt, *alone]
    firsts = singles[: 1 if leads else 2]
    found = of_singles(firsts, undecided(space).of(singles), space, 1.0)
    (best,) = (j for j in found if j.added == (SWIRL, latency))
    plain = undecided(space)
    assert plain.shown_by(best).share(best) > 0.98
    assert best.fit.point.values[-6:] == pytest.approx([*true, 0.03], rel=0.2)

"""What a set of shots could show, against rollouts with the effect itself."""

from __future__ import annotations

import numpy as np
import pytest

from compass_ros.cells import load
from compass_ros.discovery.candidates import Candidate
from compass_ros.discovery.objections import frame_rate, objections
from compass_ros.errors import DataError
from compass_ros.planning.information import Information, information
from compass_ros.planning.plan import Visible, label, plan_of
from compass_ros.simulation.effects import EFFECTS, Attached
from compass_ros.types import Floats
from test.discovery.planted import CALM, PUCKS, planned_response
from test.simulation.table import cell, simulator

ASKED = (
    Candidate(Attached(EFFECTS["viscous_drag"], PUCKS)),
    Candidate(Attached(EFFECTS["table_tilt"], PUCKS)),
    Candidate(Attached(EFFECTS["fan_field"], PUCKS)),
    Candidate(Attached(EFFECTS["camera_latency"], ())),
    Candidate(Attached(EFFECTS["actuation_delay"], ())),
    Candidate(Attached(EFFECTS["camera_scale"], ())),
    Candidate(Attached(EFFECTS["velocity_saturation"], ())),
    Candidate(Attached(EFFECTS["friction_cone"], ())),
)


@pytest.fixture(scope="module")
def known() -> Information:
    return information(planned_response(), ASKED)


@pytest.fixture(scope="module")
def seen(known: Information) -> dict[str, Visible]:
    return {v.name: v for v in plan_of(known).effects}


def left_over(attached: Attached, numbers: Floats) -> float:
    """Sigma that an effect moves all recordings by, after the free parameters have done their best."""
    space = planned_response()
    wider = simulator().with_effects([attached])
    values = np.tile(np.concatenate([simulator().defaults, numbers]), (len(CALM), 1))
    given = space.likelihood
    change = ((wider.observe(values, CALM, given.time_s) - given.measured) / given.sigma).ravel()
    jacobian = space.fit.linear.jacobian.reshape(change.size, -1)
    rows = np.vstack([jacobian, np.eye(jacobian.shape[1])])
    data = np.concatenate([change, np.zeros(jacobian.shape[1])])
    found, *_ = np.linalg.lstsq(rows, data, rcond=None)
    return float(np.linalg.norm(data - rows @ found))


@pytest.mark.parametrize("name", ["viscous_drag", "camera_latency", "camera_scale"])
def test_five_sigma_is_five_sigma_in_a_rollout(seen: dict[str, Visible], name: str) -> None:
    law = Attached(EFFECTS[name], PUCKS if EFFECTS[name].moves else ())
    numbers = np.where(law.amplitudes, seen[name].at_five_sigma, [q.start for q in law.effect.quantities])
    assert left_over(law, numbers) == pytest.approx(5, rel=0.15)


def test_what_parameters_absorb_is_said(seen: dict[str, Visible]) -> None:
    """Friction is free and drag is much like it; nothing that is free looks like a wrong scale of the camera."""
    assert 0.5 < seen["viscous_drag"].absorbed < 0.999
    assert seen["camera_scale"].absorbed < 0.7


def test_a_late_camera_and_a_late_arm_are_twins(seen: dict[str, Visible]) -> None:
    assert "actuation_delay" in seen["camera_latency"].twins
    assert "camera_latency" in seen["actuation_delay"].twins
    assert "table_tilt" not in seen["camera_latency"].twins
    assert seen["viscous_drag"].twins == ()


def test_a_limit_that_a_small_step_does_not_reach_is_seen(seen: dict[str, Visible]) -> None:
    assert seen["velocity_saturation"].detectable


def test_what_does_nothing_here_is_undetectable(known: Information) -> None:
    """Contacts of the table have no friction, so the shape of its cone changes nothing."""
    plan = plan_of(known)
    assert plan.undetectable == ("friction_cone",)
    assert all(not v.twins for v in plan.effects if v.name == "friction_cone")


def test_more_shots_show_no_less(known: Information) -> None:
    few, many = plan_of(known.of_shots(np.array([0, 1]))), plan_of(known)
    for one, other in zip(few.effects, many.effects, strict=True):
        assert other.at_five_sigma <= one.at_five_sigma * (1 + 1e-9)
    for a, b in zip(few.parameters, many.parameters, strict=True):
        assert b.at_five_sigma <= a.at_five_sigma * (1 + 1e-9)


def test_parameters_are_seen_as_their_standard_errors_say(known: Information) -> None:
    """Information with the others' priors taken into account: 1 / variance - 1 in prior widths."""
    space = planned_response()
    jacobian = space.fit.linear.jacobian.reshape(space.tangent.residual.size, -1)
    variance = np.diag(np.linalg.inv(jacobian.T @ jacobian + np.eye(jacobian.shape[1])))
    expected = 5 / np.sqrt(1 / variance - 1) * space.likelihood.prior_std[space.fit.free]
    np.testing.assert_allclose([p.at_five_sigma for p in plan_of(known).parameters], expected, rtol=1e-6)


def test_labels_name_the_objects_where_they_are_some() -> None:
    both, one = ASKED[0], Candidate(Attached(EFFECTS["viscous_drag"], ("puck1",)))
    walls = [Candidate(Attached(EFFECTS["local_wall"], (w,))) for w in ("left_wall", "right_wall")]
    everything = [both, one, *walls]
    assert [label(c, everything) for c in everything] == [
        "viscous_drag", "viscous_drag of puck1", "local_wall of left_wall", "local_wall of right_wall",
    ]  # fmt: skip


def shots(count: int, spread: float = 1.0) -> Floats:
    low, high = cell().reach.T
    middle = 0.5 * (low + high)
    return np.asarray(middle + spread * np.random.default_rng(0).uniform(-0.5, 0.5, (count, 4)) * (high - low))


def test_a_good_set_meets_no_objection() -> None:
    assert objections(cell(), shots(12), 60.0) == ()


@pytest.mark.parametrize(
    ("given", "rate", "words"),
    [
        (shots(12), 20.0, "20 frames a second are too slow"),
        (shots(2), 60.0, "2 shots are too few"),
        (np.tile(CALM[:1], (12, 1)), 60.0, "all shots are the same"),
    ],
)
def test_what_cannot_answer_is_refused(given: Floats, rate: float, words: str) -> None:
    with pytest.raises(DataError, match=words):
        objections(cell(), given, rate)


@pytest.mark.parametrize(
    ("frames", "rate"),
    [([40], 60.0), ([40, 40, 40], 60.0), ([100, 20, 20, 20], 100.0), ([1000, 50, 60, 70], 500.0), ([3, 1, 1, 1], 15.0)],
)
def test_the_rate_is_that_of_frames_and_not_of_what_fills_short_episodes(frames: list[int], rate: float) -> None:
    rows = [np.pad(np.arange(n) / rate, (0, max(frames) - n), mode="edge") for n in frames]
    assert frame_rate(np.stack(rows)) == pytest.approx(rate)


def test_episodes_of_one_frame_have_no_rate() -> None:
    assert frame_rate(np.zeros((3, 1))) == 0.0


@pytest.mark.parametrize("rate", [5.0, 10.0, 15.0, 24.0, 27.0])
def test_a_slow_camera_is_no_objection_where_nothing_can_touch(rate: float) -> None:
    assert objections(load("ball_drop"), np.zeros((12, 0)), rate, touching=False) == ()


@pytest.mark.parametrize(
    ("given", "rate", "words"),
    [
        (shots(12), 27.0, "27 frames a second are few"),
        (shots(5), 60.0, "5 shots are few"),
        (shots(12, 0.04), 60.0, "12 of 12 shots have another one"),
        (shots(12) * [1, 1, 1, 0] + [0, 0, 0, 0.4], 60.0, "alike in velocity"),
    ],
)
def test_what_answers_badly_is_warned_about(given: Floats, rate: float, words: str) -> None:
    (warning,) = objections(cell(), given, rate)
    assert words in warning

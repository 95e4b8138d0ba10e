"""What shows only together is called that, however narrow its error bar; what shows alone is not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from compass_ros.calibration.identifiability import IDENTIFIED, WIDER, alone, together
from compass_ros.calibration.refine import Refined, refine, standard_errors
from compass_ros.types import Floats, Together
from test.calibration.toys import likelihood

SHOTS = np.array([[1.0], [0.8], [1.2], [0.6]])
Law = Callable[[Floats, Floats], Floats]
"""(B, P, 1) values by parameter, (B, F) times -> (B, F) of the observation of a unit shot."""


def swing(v: Floats, t: Floats) -> Floats:
    """Damping, mass, dry friction of a free pendulum."""
    return np.asarray(np.exp(-v[:, 0] / v[:, 1] * t) - v[:, 2] / v[:, 1] * t)


def spring(v: Floats, t: Floats) -> Floats:
    """Stiffness, mass, damping of a free mass on a spring."""
    return np.asarray(np.exp(-v[:, 2] / v[:, 1] * t) * np.cos(np.sqrt(np.abs(v[:, 0] / v[:, 1])) * t))


def incline(v: Floats, t: Floats) -> Floats:
    """Friction and gravity."""
    return np.asarray(t - v[:, 0] * v[:, 1] * t**2)


TOGETHER: dict[str, tuple[Law, Floats, Floats, Floats, list[tuple[set[int], bool]]]] = {
    "free pendulum": (
        swing, np.array([0.2, 0.65, 0.1]), np.array([0.4, 0.2, 0.5]), np.array([1.2, 0.975, 0.9]), [({0, 1, 2}, True)],
    ),
    "mass on a spring": (
        spring, np.array([4.0, 1.0, 0.1]), np.array([4.0, 0.3, 0.6]), np.array([15.0, 1.6, 0.8]), [({0, 1, 2}, True)],
    ),
    "gain and lever": (
        lambda v, t: v[:, 0] * v[:, 1] * t, np.array([1.0, 0.5]), np.array([0.5, 0.2]), np.array([1.6, 0.9]),
        [({0, 1}, False)],
    ),
    "two dampings in a row": (
        lambda v, t: np.exp(-(v[:, 0] + v[:, 1]) * t), np.array([0.1, 0.1]), np.array([0.4, 0.4]), np.array([1.5, 0.1]),
        [({0, 1}, False)],
    ),
    "three dampings in a row": (
        lambda v, t: np.exp(-v[:, :3].sum(axis=1) * t), np.full(3, 0.1), np.full(3, 0.4), np.array([1.5, 0.1, 0.3]),
        [({0, 1, 2}, False)],
    ),
    "offset of camera and of place": (
        lambda v, t: v[:, 0] - v[:, 1] + t, np.zeros(2), np.full(2, 0.3), np.array([0.7, -0.3]), [({0, 1}, False)],
    ),
    "two groups and one alone": (
        lambda v, t: v[:, 0] / v[:, 1] + (v[:, 2] + v[:, 3]) * t + v[:, 4] * t**2,
        np.array([1.0, 1.0, 0.0, 0.0, 0.0]), np.full(5, 0.4), np.array([1.8, 0.8, 0.6, 0.5, 0.3]),
        [({0, 1}, True), ({2, 3}, False)],
    ),
}  # fmt: skip

ALONE: dict[str, tuple[Law, Floats, Floats, Floats]] = {
    "one number": (lambda v, t: v[:, 0] * t, np.zeros(1), np.ones(1), np.array([2.0])),
    "pendulum whose mass is known": (
        lambda v, t: swing(np.stack([v[:, 0], 0 * v[:, 0] + 0.975, v[:, 1]], axis=1), t),
        np.array([0.2, 0.1]), np.array([0.4, 0.5]), np.array([1.2, 0.9]),
    ),
    "coupled, and told apart by time": (
        lambda v, t: np.exp(-v[:, 0] * t) + v[:, 1] * t**2, np.zeros(2), np.full(2, 0.5), np.array([0.8, 0.9]),
    ),
    "friction under a gravity that is known to a thousandth": (
        incline, np.array([0.3, 9.81]), np.array([0.3, 0.01]), np.array([0.5, 9.81]),
    ),
    "beside one that does nothing": (
        lambda v, t: np.sin(v[:, 0] * t) + 0 * v[:, 1], np.zeros(2), np.full(2, 0.5), np.array([0.9, 0.4]),
    ),
}  # fmt: skip
TOLD = {
    "friction under a gravity that is known to a thousandth": [True, False],
    "beside one that does nothing": [True, False],
}


def fitted(law: Law, default: Floats, width: Floats, truth: Floats) -> Refined:
    def predict(values: Floats, inputs: Floats, times: Floats) -> Floats:
        return np.asarray((inputs * law(values[:, :, None], times))[..., None])

    given = likelihood(predict, tuple(truth), SHOTS, sigma=0.005, noise=0.005, bounds=(-30.0, 30.0), seconds=2.0)
    parameters = tuple(
        replace(p, half_width=w, default=d) for p, w, d in zip(given.parameters, width, default, strict=True)
    )
    return refine(replace(given, parameters=parameters, prior_mean=default, prior_std=width), default)


def said(found: Refined) -> tuple[list[bool], tuple[Together, ...]]:
    """Of each parameter whether it is identified, and the groups."""
    free, parameters = found.fit.free, found.likelihood.parameters
    identified = np.zeros(len(parameters), bool)
    identified[free] = found.alone < IDENTIFIED
    groups = together(found.among, identified[free], found.fit.point.values[free], [parameters[i] for i in free])
    return identified.tolist(), groups


@pytest.mark.parametrize("name", TOGETHER)
def test_what_shows_only_together_is_a_group_and_no_member_is_identified(name: str) -> None:
    law, default, width, truth, groups = TOGETHER[name]
    found = fitted(law, default, width, truth)
    identified, told = said(found)
    expected = [({f"toy@dyna@p{i}" for i in members}, ratios) for members, ratios in groups]
    assert [(set(group.parameters), group.ratios) for group in told] == expected
    members = set().union(*(group for group, _ in groups))
    assert identified == [i not in members for i in range(len(truth))]
    assert found.chi_square < 1.3, "what does show agrees"


def test_an_error_bar_that_is_half_its_prior_may_be_inherited() -> None:
    """Of three numbers of which two ratios show, two have narrow bars and stand three of them from the truth."""
    law, default, width, truth, _ = TOGETHER["free pendulum"]
    found = fitted(law, default, width, truth)
    _, errors = standard_errors(found)
    assert (errors < IDENTIFIED * width).any()
    assert (found.alone > 0.9).all()


@pytest.mark.parametrize("name", ALONE)
def test_what_shows_alone_is_identified(name: str) -> None:
    law, default, width, truth = ALONE[name]
    found = fitted(law, default, width, truth)
    identified, groups = said(found)
    expected = TOLD.get(name, [True] * len(truth))
    assert identified == expected
    assert groups == ()
    free, errors = standard_errors(found)
    off = np.abs(found.fit.point.values - truth)[free] / errors
    assert (off[np.array(expected)[free]] < 4).all()


def test_wider_priors_of_the_others_are_what_is_asked() -> None:
    """Against the posterior computed anew with those priors."""
    rng = np.random.default_rng(3)
    jacobian = rng.normal(size=(6, 4)) * np.array([5.0, 3.0, 0.4, 0.1])
    information = jacobian.T @ jacobian
    asked = alone(np.linalg.inv(information + np.eye(4)))
    for i in range(4):
        prior = np.full(4, 0.01)
        prior[i] = 1.0
        assert asked[i] == pytest.approx(np.sqrt(np.linalg.inv(information + np.diag(prior))[i, i]))
    assert alone(np.zeros((0, 0))).shape == (0,)


@pytest.mark.parametrize(("width", "identified"), [(1.0, False), (0.3, False), (0.1, False), (0.01, True)])
def test_what_was_screened_out_counts_too(width: float, identified: bool) -> None:
    """Of two numbers that add up, among hundreds, one is freed; the other's prior says how well it is known."""
    scale = np.ones(130)
    scale[1] = width
    given = likelihood(
        lambda v, i, t: (i * (v[:, :1] + v[:, 1:2]) * t)[..., None],
        (0.4,) + (0.0,) * 129,
        SHOTS,
        sigma=0.005,
        noise=0.005,
    )
    found = refine(replace(given, prior_std=scale), given.prior_mean)
    assert found.fit.free.tolist() == [0]
    assert (found.alone < IDENTIFIED).tolist() == [identified]
    assert found.alone[0] == pytest.approx(min(WIDER * width / np.sqrt(1 + (WIDER * width) ** 2), 1.0), abs=0.02)


def test_a_group_says_itself_in_a_sentence() -> None:
    assert Together(("m", "d", "f"), ratios=True).sentence == "m : d : f show only as ratios"
    assert Together(("a", "b", "c"), ratios=False).sentence == "a, b and c show only together"
    assert Together(tuple("abcd"), ratios=False).sentence == "a, b, c and d show only together"
    assert Together(tuple("abcde"), ratios=False).sentence == "a, b, c, d and e show only together"
    assert Together(tuple("abcdefg"), ratios=True).sentence == "a, b, c, d and 3 more show only as ratios"

"""Which of many parameters act: groups without any effect are dismissed, and nothing that acts ever is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from compass_ros.calibration.least_squares import start
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.refine import refine, sensitivity
from compass_ros.calibration.screen import GROUP, acting, alike
from compass_ros.types import Floats, Parameter
from test.calibration.toys import likelihood, linear

SHOTS = np.array([[1.0], [-0.7], [0.4]])
FEW = 3
KINDS = ("stiffness", "margin", "friction", "mass")


class Counted:
    """A line in time whose three coefficients are parameters 7, 250 and 299 of 300; counts its rollouts."""

    places = (7, 250, 299)

    def __init__(self) -> None:
        self.rollouts = 0

    def __call__(self, values: Floats, inputs: Floats, time_s: Floats) -> Floats:
        self.rollouts += len(values)
        return linear(values[:, list(self.places)], inputs, time_s)


def many(predict: Counted, count: int = 300, noise: float = 0.0) -> Likelihood:
    """Parameters named after a hundred bodies and four kinds of field; bounds that leave no room upwards for some."""
    truth = np.zeros(count)
    truth[list(predict.places)] = (0.4, -0.3, 0.2)
    made = likelihood(predict, truth.tolist(), SHOTS, noise=noise)
    named = [
        Parameter(f"body{i // 4}@dyna@{KINDS[i % 4]}", 0.0, -10.0, 0.1 if i == 250 else 10.0, "1", 1.0)
        for i in range(count)
    ]
    return replace(made, parameters=tuple(named))


def test_groups_hold_everything_once_and_only_what_is_alike() -> None:
    names = [p.name for p in many(Counted()).parameters]
    groups = alike(names)
    assert sorted(np.concatenate(groups).tolist()) == list(range(300))
    assert max(map(len, groups)) <= GROUP
    assert all(len({names[i].rpartition("@")[2] for i in group}) == 1 for group in groups)


def test_what_acts_is_kept_and_most_of_the_rest_dismissed_for_few_rollouts() -> None:
    predict = Counted()
    given = many(predict)
    predict.rollouts = 0
    kept = acting(given, start(given, np.zeros(300)), 0.3)
    assert predict.rollouts < 300 * len(SHOTS) / 10
    assert kept[list(predict.places)].all()
    assert kept.sum() <= len(predict.places) * GROUP


def test_a_short_list_is_not_grouped() -> None:
    predict = Counted()
    given = likelihood(predict, [0.0] * 300, SHOTS)
    given = replace(given, parameters=given.parameters[:100], predict=lambda *_: pytest.fail("no rollout"))
    assert acting(given, start(given, np.zeros(100)), 0.3).all()


def test_strengths_are_those_that_one_by_one_gives() -> None:
    predict = Counted()
    given = many(predict, noise=0.01)
    point = start(given, np.zeros(300))
    strength, steps = sensitivity(given, point)
    felt = np.flatnonzero(strength)
    assert felt.tolist() == list(predict.places)
    seen = [np.sqrt(np.sum((np.square(SHOTS) @ given.time_s[:1] ** (2 * n)) / 0.01**2)) for n in range(FEW)]
    np.testing.assert_allclose(strength[felt], seen, rtol=1e-6)
    assert (steps > 0).all()


def test_the_causes_among_three_hundred_are_found() -> None:
    given = many(Counted(), noise=0.01)
    found = refine(given, np.zeros(300))
    assert found.fit.free.tolist() == list(Counted.places)
    np.testing.assert_allclose(found.fit.point.values[found.fit.free], (0.4, -0.3, 0.2), atol=0.03)
    assert np.count_nonzero(found.fit.point.values) == FEW

"""Which of many parameters act: groups without any effect are dismissed, and nothing that acts ever is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from compass_ros.calibration.cost import start
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.refine import refine, sensitivity, standard_errors
from compass_ros.calibration.screen import GROUP, acting, alike, coupling, independent
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


def hundreds(predict: Counted, count: int = 300, noise: float = 0.0) -> Likelihood:
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
    names = [p.name for p in hundreds(Counted()).parameters]
    groups = alike(names)
    assert sorted(np.concatenate(groups).tolist()) == list(range(300))
    assert max(map(len, groups)) <= GROUP
    assert all(len({names[i].rpartition("@")[2] for i in group}) == 1 for group in groups)


def test_what_acts_is_kept_and_most_of_the_rest_dismissed_for_few_rollouts() -> None:
    predict = Counted()
    given = hundreds(predict)
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
    given = hundreds(predict, noise=0.01)
    point = start(given, np.zeros(300))
    found = sensitivity(given, point)
    strength = found.strength
    felt = np.flatnonzero(strength)
    assert felt.tolist() == list(predict.places)
    seen = [np.sqrt(np.sum((np.square(SHOTS) @ given.time_s[:1] ** (2 * n)) / 0.01**2)) for n in range(FEW)]
    np.testing.assert_allclose(strength[felt], seen, rtol=1e-6)
    assert (found.steps > 0).all()
    np.testing.assert_allclose(np.sqrt(np.diag(found.gram)), strength)


def test_the_causes_among_three_hundred_are_found() -> None:
    given = hundreds(Counted(), noise=0.01)
    found = refine(given, np.zeros(300))
    assert found.fit.free.tolist() == list(Counted.places)
    np.testing.assert_allclose(found.fit.point.values[found.fit.free], (0.4, -0.3, 0.2), atol=0.03)
    assert np.count_nonzero(found.fit.point.values) == FEW


def test_of_two_that_do_the_same_the_stronger_stands_for_both() -> None:
    """Columns: a, half of a, b, a + b, nothing."""
    a, b = np.eye(2)
    columns = 100.0 * np.stack([a, 0.5 * a, b, a + b, 0 * a], axis=1)
    gram = columns.T @ columns
    assert independent(gram, 5.0).tolist() == [0, 3]
    assert independent(gram, 80.0).tolist() == [3]
    assert independent(gram[:2, :2], 5.0).tolist() == [0]
    assert independent(np.zeros((3, 3)), 0.0).tolist() == []


def test_what_another_could_explain_is_as_uncertain_as_both_are() -> None:
    """Two parameters with the same effect: only their sum is known, each to 1 / sqrt 2 of its prior."""
    gram = 1e4 * np.ones((2, 2))
    alone = 1 / np.sqrt(1 + 1e4)
    np.testing.assert_allclose(coupling(gram, np.array([0]), 1.0) * alone, np.sqrt(0.5), rtol=1e-3)
    np.testing.assert_allclose(coupling(1e4 * np.eye(2), np.array([0]), 1.0), 1.0)


def test_a_parameter_that_the_data_cannot_tell_from_another_has_a_wide_error() -> None:
    predict = Counted()
    twin = hundreds(predict, noise=0.01)

    def twice(values: Floats, inputs: Floats, time_s: Floats) -> Floats:
        both = values.copy()
        both[:, 7] += 0.5 * values[:, 8]
        return predict(both, inputs, time_s)

    found = refine(replace(twin, predict=twice), np.zeros(300))
    free, errors = standard_errors(found)
    assert free.tolist() == list(Counted.places), "8 does what 7 does, and less of it"
    assert errors[0] == pytest.approx(np.sqrt(0.2), rel=0.05)
    assert (errors[1:] < 0.05).all()

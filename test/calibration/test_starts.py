"""Other starts: a fit that is lost from the defaults finds the minimum, each object from the start that suits it."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from compass_ros.calibration.cost import ROBUST, cost, start
from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.refine import growing, refine, stages
from compass_ros.calibration.starts import crossed, draws, lost, parts
from compass_ros.types import Floats
from test.calibration.toys import likelihood

TRUTH = 2.2, 2.2, -2.3, 2.1, -2.25, -2.3
ONE = np.ones((3, 1))


def wavy(values: Floats, inputs: Floats, time_s: Floats) -> Floats:
    """(B, F, P): each number of its own parameter alone. It rises from 0 to 0.65, falls to 1.44 and then rises on."""
    told = values + 0.9 * np.sin(3 * values)
    return np.asarray(told[:, None, :] * np.sqrt(0.2 + time_s)[:, :, None] * inputs[:, None, :1])


def objects(noise: float = 0.01) -> Likelihood:
    """Six objects with a parameter each, behind the fall."""
    given = likelihood(wavy, TRUTH, ONE, sigma=0.01, noise=noise, half_width=2.0, bounds=(-2.7, 2.7))
    named = tuple(replace(p, name=f"object{i}@dyna@p") for i, p in enumerate(given.parameters))
    return replace(given, parameters=named, windowed=True)


def test_a_fit_that_is_lost_from_the_defaults_begins_elsewhere() -> None:
    given = objects()
    *_, (part, alone) = growing(given, np.zeros(6))
    assert lost(part, alone.point)
    assert np.abs(alone.point.values - TRUTH).max() > 0.5
    np.testing.assert_allclose(refine(given, np.zeros(6)).fit.point.values, TRUTH, atol=0.02)


def test_no_start_alone_is_right_for_all_objects() -> None:
    """What the crossing over is for: otherwise the test above would show nothing of it."""
    given = objects()
    for drawn in draws(given, np.arange(6), np.zeros(6)):
        *_, (_, fit) = growing(given, drawn)
        assert np.abs(fit.point.values - TRUTH).max() > 0.5


def test_a_fit_that_explains_the_beginning_is_left_alone() -> None:
    given = objects()
    near = np.array(TRUTH) + 0.05
    plain, begins = list(growing(given, near)), list(stages(given, near))
    assert len(plain) == len(begins)
    for (_, one), (_, other) in zip(plain, begins, strict=True):
        np.testing.assert_array_equal(one.point.values, other.point.values)


def test_a_shot_begins_simply_and_is_not_sought_elsewhere() -> None:
    given = replace(objects(), windowed=False)
    (_, plain), (_, first) = (next(fits(given, np.zeros(6))) for fits in (growing, stages))
    np.testing.assert_array_equal(plain.point.values, first.point.values)


def test_each_object_keeps_the_values_that_suit_it() -> None:
    """Beside all mixtures that there are: the objects do not know of each other, so the best one is found."""
    given = objects()
    some = draws(given, np.arange(6), np.zeros(6))[:3]
    found = crossed(given, list(some), ROBUST)
    mixed = [np.array([some[k][i] for i, k in enumerate(of)]) for of in product(range(len(some)), repeat=6)]
    costs, _ = cost(given, [start(given, values) for values in mixed], ROBUST)
    assert cost(given, [found], ROBUST)[0][0] == pytest.approx(costs.min(), rel=1e-12)


def test_starts_are_of_the_prior_and_the_same_each_time() -> None:
    given = replace(
        objects(), prior_mean=np.array([2.0, 0.0, -1.0, 0, 0, 0]), prior_std=np.array([0.5, 1.0, 3.0, 1, 1, 1])
    )
    one, other = (draws(given, np.array([0, 2]), np.full(6, 9.0)) for _ in range(2))
    np.testing.assert_array_equal(one, other)
    assert (one[:, 1] == 9.0).all()
    scaled = (one[:, [0, 2]] - [2.0, -1.0]) / [0.5, 3.0]
    assert (np.abs(scaled) < 3).all()
    assert np.abs(scaled.mean(axis=0)).max() < 0.5
    assert ((one >= given.low) & (one <= given.high))[:, [0, 2]].all()


def test_parts_are_what_the_names_say() -> None:
    given = objects()
    named = ("arm@dyna@mass", "servo@actuation@gain", "arm@dyna@friction")
    given = replace(given, parameters=tuple(replace(p, name=n) for p, n in zip(given.parameters, named, strict=False)))
    assert [part.tolist() for part in parts(given)] == [[0, 2], [1]]

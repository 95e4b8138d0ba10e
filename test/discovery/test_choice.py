"""What may be named: laws that lie apart from zero, that are what their name says, and that predict; two like one."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from compass_ros.calibration.least_squares import Fit, Point, linearise, minimise
from compass_ros.calibration.refine import ROBUST
from compass_ros.discovery.choice import Choice, undecided
from compass_ros.discovery.joint import Joint, widened
from compass_ros.discovery.pairs import needs_each
from compass_ros.discovery.screen import Space
from compass_ros.discovery.unseen import HeldOut, held_out
from compass_ros.simulation.effects import EFFECTS, Attached
from test.discovery.planted import HELD_OUT, PUCKS, joint, planned_space, recorded, recorded_with, space_of
from test.simulation.table import simulator

DRAG = Attached(EFFECTS["viscous_drag"], PUCKS)


@pytest.mark.parametrize(
    ("name", "numbers", "apart"),
    [
        ("viscous_drag", [0.3], True),
        ("viscous_drag", [1e-4], False),
        ("viscous_drag", [0.0], False),
        ("table_tilt", [5e-3, 0.0], True),
        ("table_tilt", [0.0, -5e-3], True),
        ("table_tilt", [1e-6, 1e-6], False),
        ("swirl", [0.1, 0.0, 0.0, 0.12, 0.5], True),
        ("swirl", [1e-5, 0.0, 0.0, 0.12, 0.5], False),
        ("camera_scale", [0.02], True),
        ("camera_scale", [1e-5], False),
        ("magnus", [-0.3], True),
        ("magnus", [1e-4], False),
    ],
)
def test_a_law_within_two_of_its_error_bars_of_zero_is_none(name: str, numbers: list[float], apart: bool) -> None:
    kind = EFFECTS[name]
    attached = Attached(kind, PUCKS if kind.moves else ())
    space = copy.copy(planned_space())
    space.likelihood = recorded(attached, numbers)
    assert joint(space, attached, numbers).distinct is apart


def pair(space: Space, second: Attached, numbers: Sequence[float]) -> Joint:
    """A drag and a second law, at an optimum that was reached."""
    wider, likelihood = widened(simulator(), space.likelihood, [DRAG, second])
    known = len(simulator().defaults)
    free = np.concatenate([space.fit.free, known + np.arange(1 + len(numbers))])
    point = Point(np.concatenate([simulator().defaults, [0.3], numbers]), space.fit.point.launch, 0.0)
    linear = linearise(likelihood, point, free, np.full(len(free), 0.02))
    return Joint(wider, likelihood, Fit(point, linear, free, ROBUST, 0, True), (DRAG, second))


@pytest.fixture(scope="module")
def drag() -> tuple[Space, HeldOut]:
    """A table that lacks a drag, and nothing else."""
    space = space_of(recorded(DRAG, [0.3]))
    return space, held_out(recorded(DRAG, [0.3], HELD_OUT, 1), space.likelihood, space.fit)


@pytest.mark.parametrize(
    ("name", "numbers"),
    [
        ("table_tilt", [1e-6, 0.0]),
        ("magnus", [0.0]),
        ("camera_scale", [1e-6]),
        ("fan_field", [2e-4, -0.1, 0.0, 0.03, 0.5]),
        ("friction_patch", [1e-4, -0.1, 0.0, 0.25]),
        ("stribeck_friction", [1e-4, 0.35]),
        ("table_tilt", [0.02, 0.0]),
        ("actuation_delay", [0.1]),
    ],
)
def test_two_that_may_not_be_named_are_not_though_they_are_called_two(
    drag: tuple[Space, HeldOut], name: str, numbers: list[float]
) -> None:
    """A second law of size zero, one that stands for something else, one that the held-out shots contradict."""
    space, unseen = drag
    kind = EFFECTS[name]
    both = pair(space, Attached(kind, PUCKS if kind.moves else ()), numbers)
    alone = joint(space, DRAG, [0.3])
    choice = Choice((alone,), both, *_of(space), two=True)
    assert choice.verdict(unseen) is alone
    assert list(choice.verdicts(unseen)) == [alone]


def test_two_that_may_be_named_are(drag: tuple[Space, HeldOut]) -> None:
    tilt, numbers = Attached(EFFECTS["table_tilt"], PUCKS), [5e-3, -3e-3]
    space = space_of(recorded_with([DRAG, tilt], [0.3, *numbers]))
    unseen = held_out(recorded_with([DRAG, tilt], [0.3, *numbers], HELD_OUT, 1), space.likelihood, space.fit)
    both, alone = pair(space, tilt, numbers), joint(space, DRAG, [0.3])
    assert Choice((alone,), both, *_of(space), two=True).verdict(unseen) is both


@pytest.mark.parametrize(
    ("name", "numbers"),
    [
        ("table_tilt", [1e-3, 0.0]),
        ("magnus", [0.02]),
        ("camera_scale", [1e-3]),
        ("swirl", [0.01, 0.1, 0.05, 0.1, 0.5]),
        ("actuation_delay", [2e-3]),
    ],
)
def test_an_effect_without_which_the_rest_fits_as_well_is_not_needed(
    drag: tuple[Space, HeldOut], name: str, numbers: list[float]
) -> None:
    """Its pair had the longer fit."""
    space, _ = drag
    kind = EFFECTS[name]
    both = pair(space, Attached(kind, PUCKS if kind.moves else ()), numbers)
    fit = minimise(both.likelihood, both.fit.point, both.fit.free, 6, both.fit.robust)
    assert not needs_each(replace(both, fit=fit), space)


def test_two_that_are_there_are_both_needed_and_one_alone_is() -> None:
    tilt, numbers = Attached(EFFECTS["table_tilt"], PUCKS), [5e-3, -3e-3]
    space = space_of(recorded_with([DRAG, tilt], [0.3, *numbers]))
    both = pair(space, tilt, numbers)
    assert needs_each(replace(both, fit=minimise(both.likelihood, both.fit.point, both.fit.free, 3, ROBUST)), space)
    assert needs_each(joint(space, DRAG, [0.3]), space)


def _of(space: Space) -> tuple[float, float]:
    choice = undecided(space)
    return choice.excess, choice.floor

"""How near the library's formulas come to a law: exactly where it is theirs, and never nearer than they can."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import pytest

from compass_ros.concealed.absorption import Absorber, rms
from compass_ros.concealed.imitation import best_imitation, ideal
from compass_ros.concealed.library import FORMS, along
from compass_ros.concealed.strength import Judge, Strength, sized
from test.by_night import but
from test.concealed.scene import INPUTS, TIMES, cell, ingredient, places, table

TARGET_M = 2e-3


@cache
def judge() -> Judge:
    absorber = Absorber(cell(), cell().defaults, INPUTS, TIMES[0])
    return Judge(table(), absorber, TIMES, table().play())


def strength(name: str, other: float = 1.0) -> Strength:
    return sized(ingredient(name, judge().base, other=other), judge(), TARGET_M)


@pytest.mark.slow
@pytest.mark.parametrize("name", but(("quadratic_drag", "table_tilt", "lens_distortion"), "lens_distortion"))
def test_the_library_s_own_formula_is_found_exactly(name: str) -> None:
    own = strength(name, other=0.0)
    found = ideal(own, judge(), table().play([own.ingredient]))
    assert found is not None
    assert found.left_m < 0.01 * TARGET_M
    if name == "lens_distortion":
        assert found.numbers["k1"] == pytest.approx(0.05 * own.ingredient.size * own.ingredient.shape["hand"], rel=0.01)


@pytest.mark.nightly
def test_trajectories_are_met_better_than_by_accelerations() -> None:
    own = strength("viscous_drag")
    played = table().play([own.ingredient])
    (start,), _ = along(own.ingredient, own.ingredient, FORMS["viscous_drag"], table(), played)
    found = ideal(own, judge(), played)
    assert found is not None
    plain = strength("viscous_drag", other=0.0).ingredient

    def left(rate: float) -> float:
        change = judge().change([type(plain)(plain.law, plain.objects, plain.shape, rate / 0.02)])
        return rms(judge().absorber.left(change) - own.left)

    assert found.left_m == pytest.approx(left(found.numbers["rate"]), rel=0.02)
    assert found.left_m < left(float(start))
    assert found.left_m < 0.5 * TARGET_M


def test_a_law_of_contacts_is_no_formula_of_forces() -> None:
    own = strength("tangential_impulse")
    assert ideal(own, judge(), table().play([own.ingredient])) is None


@pytest.mark.nightly
def test_a_law_that_has_a_formula_of_the_library_is_imitated_by_it() -> None:
    own = strength("quadratic_drag", other=0.0)
    found = best_imitation(own, judge(), places(judge().base), table().play([own.ingredient]))
    assert found.name == "quadratic_drag"
    assert found.left_m < 0.01 * TARGET_M


@pytest.mark.nightly
def test_a_field_is_imitated_where_it_lies() -> None:
    """Drawn places alone lead to a fan here, which leaves 0.8 mm."""
    base = judge().base
    there = places(base).points[len(places(base).points) * 11 // 20]
    drawn = ingredient("swirl", base, other=0.0)
    shape = {**drawn.shape, "centre_x": float(there[0]), "centre_y": float(there[1]), "radius": 0.07}
    own = sized(replace(drawn, shape=shape), judge(), TARGET_M)
    found = best_imitation(own, judge(), places(base), table().play([own.ingredient]))
    assert found.name == "swirl"
    assert found.left_m < 0.01 * TARGET_M

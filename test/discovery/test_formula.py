"""Formulas found again: terms of the simulator's own library planted, and nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from compass_ros.discovery.formula import Monomial, basis, effect_of, propose, regress
from compass_ros.discovery.screen import Space
from compass_ros.simulation.effects import EFFECTS, Attached
from compass_ros.types import Floats
from test.discovery.planted import CALM, HELD_OUT, PUCKS, planned_space, recorded, space_of
from test.simulation.table import simulator

SADDLE = Monomial(0, (0, 2, 0, 0, 0))
"""ax = c y^2: no effect of the library looks like it."""
SIZE = 0.5
PLANTED = Attached(effect_of([SADDLE]), PUCKS)


@pytest.fixture(scope="module")
def space() -> Space:
    return space_of(recorded(PLANTED, [SIZE]))


def test_a_term_of_the_library_is_the_effect_that_it_spells() -> None:
    """Slowing proportional to speed is viscous drag."""
    drag, spelled = Attached(EFFECTS["viscous_drag"], PUCKS), Attached(effect_of([Monomial(2, (0, 0, 0, 0, 1))]), PUCKS)
    time = np.linspace(0, 2.5, 50)[None]
    values = np.append(simulator().defaults, 0.3)[None]
    one, other = (simulator().with_effects([a]).observe(values, CALM[:1], time) for a in (drag, spelled))
    np.testing.assert_allclose(one, other, atol=1e-4)
    assert np.abs(one - simulator().observe(values[:, :-1], CALM[:1], time)).max() > 0.01


def test_units_and_names_are_those_of_the_term() -> None:
    assert (SADDLE.unit, SADDLE.name) == ("m^-1 s^-2", "ax_y2")
    assert Monomial(2, (0, 0, 0, 0, 2)).unit == "m^-1"
    assert Monomial(0, (0, 0, 0, 1, 0)).unit == "s^-1"
    assert len({m.name for m in basis()}) == len(basis())


def test_a_planted_term_is_found_with_its_size(space: Space) -> None:
    found = regress(space, PUCKS)[0]
    assert found.terms == (SADDLE,)
    assert found.coefficients[0] == pytest.approx(SIZE, rel=0.1)
    assert found.text.startswith("ax = +0.")
    assert found.text.endswith("y^2")


def test_noise_alone_needs_no_formula() -> None:
    for seed in range(3):
        given = recorded(None, [], seed=seed)
        quiet = planned_space()
        noise = (quiet.likelihood.measured - given.measured) / given.sigma
        assert regress(with_residual(quiet, noise), PUCKS) == ()


def with_residual(space: Space, residual: Floats) -> Space:
    """The same tangents around another residual (E, F, C)."""
    linear = replace(space.fit.linear, residual=residual)
    return Space(space.simulator, space.likelihood, replace(space.fit, linear=linear), space.pushes)


def test_a_formula_is_kept_because_held_out_shots_gain(space: Space) -> None:
    found = propose(space, recorded(PLANTED, [SIZE], HELD_OUT, seed=7))
    assert found is not None
    assert found.held_out_gain > 0.8
    assert "proposed" in found.sentence
    assert "not named" in found.sentence
    assert found.formula.terms == (SADDLE,)
    assert found.formula.coefficients[0] == pytest.approx(SIZE, rel=0.05)


def test_a_formula_that_held_out_shots_contradict_is_dropped(space: Space) -> None:
    assert propose(space, recorded(PLANTED, [-SIZE], HELD_OUT, seed=7)) is None

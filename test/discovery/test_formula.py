"""Formulas found again: terms of the simulator's own library planted, and nothing."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from compass_ros.discovery.candidates import Candidate
from compass_ros.discovery.formula import (
    Formula,
    Monomial,
    Variables,
    basis,
    effect_of,
    of_joint,
    propose,
    regress,
    spelled,
)
from compass_ros.discovery.screen import Score, Space
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import EFFECTS, Attached
from compass_ros.simulation.sizes import unit_joint
from compass_ros.simulation.visited import Visited
from compass_ros.types import Floats
from test.discovery.planted import CALM, HELD_OUT, PUCKS, planned_space, recorded, space_of
from test.simulation import robots
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
    assert "of the library" not in found.sentence


def test_a_formula_that_held_out_shots_contradict_is_dropped(space: Space) -> None:
    assert propose(space, recorded(PLANTED, [-SIZE], HELD_OUT, seed=7)) is None


def written(terms: list[Monomial], numbers: list[float], objects: tuple[str, ...]) -> Formula:
    attached = Attached(effect_of(terms), objects)
    score = Score(Candidate(attached), np.array(numbers), 1.0, np.empty(0))
    return Formula(tuple(terms), np.array(numbers), 1.0, score)


@pytest.mark.parametrize(
    ("terms", "numbers", "laws"),
    [
        ([(2, 0, 0, 0, 0, 0)], [0.3], ["coulomb_friction"]),
        ([(2, 0, 0, 0, 0, 1)], [0.3], ["viscous_drag"]),
        ([(2, 0, 0, 0, 0, 2)], [0.5], ["quadratic_drag"]),
        ([(0, 0, 0, 1, 0, 0), (1, 0, 0, 0, 1, 0)], [-0.3, -0.3], ["viscous_drag"]),
        ([(0, 0, 0, 0, 0, 0)], [0.02], ["table_tilt"]),
        ([(0, 0, 0, 0, 0, 0), (1, 0, 0, 0, 0, 0)], [0.02, -0.01], ["table_tilt"]),
        ([(0, 0, 0, 0, 1, 0), (1, 0, 0, 1, 0, 0)], [-0.4, 0.4], ["magnus"]),
        ([(2, 1, 0, 0, 0, 0), (2, 0, 1, 0, 0, 0)], [0.05, 0.1], ["friction_gradient"]),
        ([(2, 0, 0, 0, 0, 0), (2, 0, 0, 0, 0, 2)], [0.1, 0.5], ["coulomb_friction", "quadratic_drag"]),
        ([(2, 0, 0, 0, 0, 2)], [-0.5], []),
        ([(0, 0, 2, 0, 0, 0)], [0.5], []),
        ([(0, 0, 0, 1, 0, 0)], [-0.3], []),
        ([(2, 0, 0, 0, 0, 3)], [0.5], []),
    ],
)
def test_a_formula_that_is_a_law_of_the_library_is_told_by_its_name(
    terms: list[tuple[int, int, int, int, int, int]], numbers: list[float], laws: list[str]
) -> None:
    given = [Monomial(component, tuple(powers)) for component, *powers in terms]  # type: ignore[arg-type]
    assert spelled(planned_space(), written(given, numbers, PUCKS)) == laws


@pytest.mark.parametrize("kind", ["hinge", "slide"])
@pytest.mark.parametrize(
    ("terms", "shares", "laws"),
    [
        ([(2, 0, 0)], [0.1], ["coulomb_friction"]),
        ([(2, 0, 1)], [0.1], ["viscous_drag"]),
        ([(2, 0, 2)], [0.1], ["quadratic_drag"]),
        ([(0, 0, 0), (0, 1, 0)], [0.05, -0.1], ["spring"]),
        ([(0, 1, 0)], [-0.1], ["spring"]),
        ([(0, 1, 0)], [0.1], []),
        ([(0, 3, 0)], [-0.1], []),
        ([(2, 0, 1), (0, 1, 0)], [0.1, -0.1], ["viscous_drag", "spring"]),
    ],
)
def test_so_is_one_on_a_joint(
    tmp_path: Path, kind: str, terms: list[tuple[int, int, int]], shares: list[float], laws: list[str]
) -> None:
    cell = robots.robot(tmp_path, (kind,))
    robot = Simulator(cell, threads=1)
    space = robots.space_of(robot, robots.recorded(robot, [], [], robots.shots(cell, 3)))
    of = of_joint(Visited(robot, *space.told).joint_sizes()["j0"])
    given = [Monomial(component, (place, 0, 0, 0, speed), of) for component, place, speed in terms]
    numbers = [share * of.largest / term.size for share, term in zip(shares, given, strict=True)]
    assert spelled(space, written(given, numbers, ("j0",))) == laws


def test_on_a_joint_it_is_written_in_what_the_joint_has(tmp_path: Path) -> None:
    of: Variables = of_joint(unit_joint("hinge"))
    assert [(m.name, m.unit) for m in basis(of)] == [
        ("torque", "N m"),
        ("torque_q", "N m rad^-1"),
        ("torque_q2", "N m rad^-2"),
        ("torque_q3", "N m rad^-3"),
        ("slowing_torque", "N m"),
        ("slowing_torque_speed", "N m rad^-1 s"),
        ("slowing_torque_q", "N m rad^-1"),
        ("slowing_torque_q_speed", "N m rad^-2 s"),
        ("slowing_torque_q2", "N m rad^-2"),
        ("slowing_torque_q2_speed", "N m rad^-3 s"),
        ("slowing_torque_speed2", "N m rad^-2 s^2"),
        ("slowing_torque_speed3", "N m rad^-3 s^3"),
    ]
    terms = [m for m in basis(of) if m.name in ("torque_q", "slowing_torque_speed2")]
    text = written(terms, [-2.0, 0.1], ("j0",)).text
    assert text == "torque = -2 q, slowing torque = +0.1 speed^2"

"""Each law does nothing at size zero, something at size one, and with the library's formula what the library does."""

from __future__ import annotations

import numpy as np
import pytest

from compass_ros.concealed.law import Ingredient
from compass_ros.concealed.laws import KNOWN, LAWS, OUTSIDE
from compass_ros.concealed.library import FORMS, along, in_library_terms
from compass_ros.concealed.table import Played
from compass_ros.simulation import Simulator
from compass_ros.simulation.effects import EFFECTS, Attached
from compass_ros.simulation.site_kinds import PAIRS
from compass_ros.types import Floats
from test.concealed.scene import INPUTS, TIMES, cell, distance, ingredient, table, tracks
from test.discovery.planted import asked_of_table

SAME = {"coulomb_friction", "friction_cone"}
"""Effects that are asked of this cell and that it cannot show: its own sliding friction, a choice that its contacts
lack."""
LOOSE = {
    "rate_dependent_restitution": 0.35,  # decided at the first touch here, at every moment there
    "tangential_impulse": 0.10,  # a true Coulomb limit here, faded at 10 mm/s there
    "off_centre_mass": 0.10,
    "pulsating_lift": 0.05,
    "stroke_jitter": 0.05,
}
"""Relative difference of what is moved, where the laws differ by their nature; 3 % else."""


@pytest.fixture(scope="module")
def base() -> Played:
    return table().play()


def test_every_effect_of_the_library_that_the_cell_can_show_has_a_law() -> None:
    asked = {c.name for c in asked_of_table()} | {name for name, e in EFFECTS.items() if e.scattered}
    between = {name for name, e in EFFECTS.items() if set(e.on) <= set(PAIRS)}  # two pucks, or puck and pusher
    assert set(KNOWN) == asked - SAME - between
    assert not set(OUTSIDE) & set(EFFECTS)
    assert all(KNOWN[name].channel == EFFECTS[name].channel for name in KNOWN)


@pytest.mark.parametrize("name", sorted(LAWS))
def test_at_size_zero_a_law_changes_nothing(name: str, base: Played) -> None:
    absent = ingredient(name, base, size=0.0)
    assert distance(tracks(table().play([absent]), absent), tracks(base)) < 1e-6


@pytest.mark.parametrize("name", sorted(LAWS))
def test_a_law_moves_the_pucks(name: str, base: Played) -> None:
    present = ingredient(name, base, size=5 * LAWS[name].first)
    assert distance(tracks(table().play([present]), present), tracks(base)) > 1e-4


@pytest.mark.parametrize("name", sorted(LAWS))
def test_the_same_draw_gives_the_same_shape(name: str, base: Played) -> None:
    assert ingredient(name, base, seed=7).shape == ingredient(name, base, seed=7).shape


@pytest.mark.nightly
@pytest.mark.parametrize("name", sorted(KNOWN))
def test_with_the_formula_of_the_library_it_does_what_the_library_does(name: str, base: Played) -> None:
    own = _modest(ingredient(name, base, other=0.0), base)
    moved = tracks(table().play([own]), own) - tracks(base)
    there = _library(name, own, base) - tracks(base)
    assert distance(moved, there) < LOOSE.get(name, 0.03) * distance(moved, 0 * moved)


def _modest(own: Ingredient, base: Played) -> Ingredient:
    """Some millimetres, so that what is compared is not lost in chaos."""
    for _ in range(5):
        change = distance(tracks(table().play([own]), own), tracks(base))
        if 5e-4 < change < 4e-3:
            return own
        size = own.size / float(np.clip(change / 1.5e-3, 0.3, 10.0))
        own = Ingredient(own.law, own.objects, own.shape, size)
    return own


def _library(name: str, own: Ingredient, base: Played) -> Floats:
    """What the simulator says with its own effect of that name, at the quantities that the answer would state."""
    effect = EFFECTS[name]
    objects = own.objects if effect.moves or effect.on_walls else ()
    simulator = Simulator(cell(), [Attached(effect, objects)], threads=1)
    played = table().play([own])
    terms = in_library_terms(own, played)
    if name in FORMS:
        terms = dict(zip(FORMS[name].names, along(own, own, FORMS[name], table(), played)[0], strict=True))
    if name == "lens_distortion":
        terms = {"k1": 0.05 * own.size * own.shape["hand"]}
    if name == "off_centre_mass":
        terms["arm"] = 0.0  # with the formula of the library the lump's inertia is left out
    numbers = np.array([[0.0 if q.later else terms[q.name] for q in effect.quantities]] * len(INPUTS))
    if name == "stroke_jitter":
        numbers = np.array([[0.005 * own.size * own.shape[f"shot_{i}"]] for i in range(len(INPUTS))])
    values = np.hstack([np.tile(cell().defaults, (len(INPUTS), 1)), numbers])
    return simulator.observe(values, INPUTS, TIMES)

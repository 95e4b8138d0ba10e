"""Where something nameless acts: on the mover that feels it, and on all unless the others clearly feel nothing."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from compass_ros.discovery.choice import undecided
from compass_ros.discovery.unknown import whereabouts
from compass_ros.simulation.effects import EFFECTS, Attached
from test.discovery.planted import CALM, HELD_OUT, PUCKS, recorded, space_of

SHOTS = np.vstack([CALM, HELD_OUT])
STRONG = {"crosswind": (0.01, 0.005, 1.0), "magnus": (0.05,)}


@pytest.mark.parametrize("name", STRONG)
@pytest.mark.parametrize("objects", [PUCKS, PUCKS[:1], PUCKS[1:]])
def test_a_push_is_told_on_the_objects_that_feel_it(name: str, objects: tuple[str, ...]) -> None:
    assert told(name, objects, STRONG[name]) == ("all" if objects == PUCKS else objects[0])


def test_where_the_second_puck_says_nothing_all_are_told() -> None:
    """The first is struck and carries nine tenths of what a drag does: that the other has none is not shown."""
    assert told("quadratic_drag", PUCKS, (0.02,)) == "all"


def test_noise_alone_stands_out_nowhere() -> None:
    space = space_of(recorded(None, ()))
    assert not whereabouts(space, undecided(space))[1]


def told(name: str, objects: tuple[str, ...], numbers: Sequence[float]) -> str:
    """The object on which an effect is located that is left out."""
    space = space_of(recorded(Attached(EFFECTS[name], objects), numbers, SHOTS))
    where, sure = whereabouts(space, undecided(space))
    assert sure
    assert (where.phase, where.channel) == ("free", "dynamics")
    return where.object

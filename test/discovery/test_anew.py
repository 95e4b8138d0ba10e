"""What parameters stand for is found from the first guess."""

from __future__ import annotations

import numpy as np
import pytest

from compass_ros.discovery.anew import beginning, contacts_anew
from compass_ros.discovery.candidates import Candidate
from compass_ros.discovery.screen import Score
from compass_ros.discovery.trials import worth
from compass_ros.simulation.effects import EFFECTS, Attached
from test.discovery.planted import CALM, HELD_OUT, PUCKS, asked_of_table, planned_space, recorded, space_of

SLOPE = Attached(EFFECTS["rate_dependent_restitution"], ())
LUMP = Attached(EFFECTS["off_centre_mass"], ("puck1",))


def score(attached: Attached, numbers: list[float]) -> Score:
    return Score(Candidate(attached), np.array(numbers), 0.0, np.zeros(planned_space().residual.size))


@pytest.mark.slow
def test_an_effect_of_contacts_of_which_first_order_knows_nothing_is_found() -> None:
    """The screen says nothing of any; a lump and friction of the rims are tried beside it."""
    likelihood = recorded(SLOPE, [0.5], np.concatenate([CALM, HELD_OUT]))
    scores = [
        Score(c, np.array([q.start for q in c.attached.effect.quantities]), 0.0, np.zeros(likelihood.measured.size))
        for c in asked_of_table()
        if c.name in ("off_centre_mass", "tangential_impulse", "rate_dependent_restitution", "table_tilt")
    ]
    best = min(contacts_anew(space_of(likelihood), scores), key=worth)
    assert best.added == (SLOPE,)
    assert best.fit.point.values[-1] == pytest.approx(0.5, rel=0.1)
    assert 2 * best.fit.point.cost < 1.1 * likelihood.measurements


def test_a_fit_begins_with_a_modest_effect_where_first_order_points() -> None:
    assert beginning(score(LUMP, [-3e-4, 4e-4, 0.01]), 1.0) == pytest.approx([-6e-4, 8e-4, 0.01])
    assert beginning(score(LUMP, [3e-3, -4e-3, 0.01]), 1.0) == pytest.approx([3e-3, -4e-3, 0.01])
    assert beginning(score(LUMP, [0.0, 0.0, 0.02]), 1.0) == pytest.approx([1e-3, 0.0, 0.02])
    assert beginning(score(SLOPE, [-0.01]), 0.1) == pytest.approx([-0.05])
    assert beginning(score(SLOPE, [-0.01]), 1.0) == pytest.approx([-0.5])
    assert beginning(score(Attached(EFFECTS["table_tilt"], PUCKS), [0.0, 0.0]), 1.0).any()

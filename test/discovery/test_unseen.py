"""What a fit at the noise floor does not predict is noticed; what it predicts raises no alarm."""

from __future__ import annotations

import pytest

from compass_ros.calibration.refine import refine
from compass_ros.discovery.choose import Choice
from compass_ros.discovery.unseen import held_out, unexpected
from compass_ros.simulation.effects import EFFECTS, Attached
from test.discovery.planted import HELD_OUT, PUCKS, joint, recorded, space_of
from test.simulation.table import simulator

DRAG = Attached(EFFECTS["viscous_drag"], PUCKS)


def test_only_shots_on_another_table_are_unexpected() -> None:
    refined = refine(recorded(None, []), simulator().defaults)
    assert refined.chi_square < 1.2
    assert not unexpected(recorded(None, [], HELD_OUT, 1), refined)
    assert unexpected(recorded(DRAG, [0.3], HELD_OUT, 1), refined)


def test_what_predicts_only_a_part_helps_and_is_not_named() -> None:
    """Half of the true drag leaves a quarter of the surprise."""
    space = space_of(recorded(DRAG, [0.3]))
    unseen = held_out(recorded(DRAG, [0.3], HELD_OUT, 1), space.likelihood, space.fit)
    whole, half = joint(space, DRAG, [0.3]), joint(space, DRAG, [0.15])
    choice = Choice((whole, half), None, excess=1000.0, floor=0.0)  # both explain the fitted episodes
    assert unseen.share(whole) == pytest.approx(1.0, abs=0.02)
    assert unseen.share(half) == pytest.approx(0.75, abs=0.1)
    assert unseen.helps(whole)
    assert unseen.helps(half)
    assert choice.nameable(whole, unseen)
    assert not choice.nameable(half, unseen)

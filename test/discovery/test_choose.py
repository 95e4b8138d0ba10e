"""What a pair of effects says of each of the two alone."""

from __future__ import annotations

import numpy as np
import pytest

from compass_ros.discovery.candidates import Candidate
from compass_ros.discovery.choose import _one_of
from compass_ros.discovery.joint import fit_jointly
from compass_ros.discovery.screen import Score
from compass_ros.simulation.effects import EFFECTS, Attached
from test.discovery.planted import PUCKS, recorded, space_of

SWIRL = Attached(EFFECTS["swirl"], PUCKS)
TILT = Attached(EFFECTS["table_tilt"], PUCKS)
PLANTED = [0.03, -0.05, 0.04, 0.1, 0.5]


@pytest.mark.parametrize("swirl_at", [0, 1])
def test_one_of_a_pair_that_does_nothing_can_be_left_out_and_the_other_cannot(swirl_at: int) -> None:
    space = space_of(recorded(SWIRL, PLANTED))
    nothing = np.zeros_like(space.residual)
    scores = [Score(Candidate(TILT), np.array([1e-4, 1e-4]), 1.0, nothing)]
    scores.insert(swirl_at, Score(Candidate(SWIRL), np.array(PLANTED) * [0.8, 0.9, 1.1, 1.1, 1.0], 100.0, nothing))
    pair = fit_jointly(space, scores, 4)
    swirl, tilt = _one_of(pair, swirl_at, space), _one_of(pair, 1 - swirl_at, space)
    assert (swirl.name, tilt.name) == ("swirl", "table_tilt")
    assert swirl.fit.point.cost < pair.fit.point.cost + 3.0
    assert tilt.fit.point.cost > 2.0 * pair.fit.point.cost
    assert swirl.fit.point.values[-5:-1] == pytest.approx(PLANTED[:4], rel=0.1)

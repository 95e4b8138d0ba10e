"""What is missing is noticed where it moves something: in the fitted episodes, or in others."""

from __future__ import annotations

import numpy as np
import pytest

from compass_ros.calibration.likelihood import Likelihood
from compass_ros.calibration.noise import Noise
from compass_ros.calibration.refine import refine
from compass_ros.discovery.noticed import noticed
from compass_ros.discovery.null import simulate_null
from compass_ros.discovery.tangents import screen
from compass_ros.discovery.unseen import held_out
from compass_ros.simulation.effects import EFFECTS, Attached
from test.discovery.planted import HELD_OUT, PUCKS, SIGMA, asked_of_table, recorded
from test.simulation.table import simulator

DRAG = Attached(EFFECTS["viscous_drag"], PUCKS)
NOISE = Noise(np.full(4, SIGMA), 0.0)


@pytest.mark.slow
def test_what_hardly_moves_the_fitted_shots_matters_where_it_moves_others() -> None:
    """A drag of 0.2 mm in the fitted shots stands out from the noise; a tracker may be as wrong by itself."""
    plain = refine(recorded(DRAG, [0.016]), simulator().defaults)
    space, scores = screen(simulator(), plain.likelihood, plain.fit, asked_of_table())
    null = simulate_null(space, scores, NOISE, 0)
    assert scores[0].gain > 1.2 * null.largest

    def moves(episodes: Likelihood) -> bool:
        return noticed(space, scores, null, NOISE, held_out(episodes, space.likelihood, space.fit))

    assert not moves(plain.likelihood)
    assert moves(recorded(DRAG, [0.016], HELD_OUT, 1))

"""A frequency that first order gets wrong is found among others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from compass_ros.discovery.candidates import Candidate
from compass_ros.discovery.screen import Score, Space
from compass_ros.discovery.trials import at_other_rates
from compass_ros.simulation.effects import EFFECTS, Attached
from test.discovery.planted import PUCKS, joint, recorded, recorded_with, space_of

PULSATION = Attached(EFFECTS["pulsating_lift"], PUCKS)
TILT = Attached(EFFECTS["table_tilt"], PUCKS)


@pytest.mark.slow
def test_half_of_the_true_frequency_leads_to_the_true_one() -> None:
    space = space_of(recorded(PULSATION, [0.0, 0.02, 0.7]))
    nothing = np.zeros_like(space.residual)
    wrong = Score(Candidate(PULSATION), np.array([0.003, 0.003, 0.35]), 100.0, nothing)
    best = at_other_rates(space, [wrong])
    assert best is not None
    assert best.fit.point.values[-1] == pytest.approx(0.7, abs=0.02)
    assert np.hypot(*best.fit.point.values[-3:-1]) == pytest.approx(0.02, rel=0.1)
    tilt = Score(Candidate(TILT), np.zeros(2), 300.0, nothing)
    assert at_other_rates(space, [tilt, wrong]) is None
    assert at_other_rates(space, [replace(tilt, gain=1.0)]) is None


@pytest.mark.slow
def test_a_frequency_beside_another_effect_leaves_that_where_it_was_found() -> None:
    """The fit begins at the cell's first guess, but for the tilt that is in the simulator already."""
    lean, rest = [0.004, -0.003], [0.0, 0.02, 0.7]
    plain = space_of(recorded_with([TILT, PULSATION], [*lean, *rest]))
    tilted = joint(plain, TILT, lean)
    space = Space(tilted.simulator, tilted.likelihood, tilted.fit, plain.pushes)
    guess = Score(Candidate(PULSATION), np.array([0.003, 0.003, 0.5]), 100.0, np.zeros_like(plain.residual))
    best = at_other_rates(space, [guess])
    assert best is not None
    assert best.fit.point.values[-5:-3] == pytest.approx(lean, rel=0.1)
    assert best.fit.point.values[-1] == pytest.approx(0.7, abs=0.02)

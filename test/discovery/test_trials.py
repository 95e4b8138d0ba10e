"""A frequency or a place that first order gets wrong is found among others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from compass_ros.discovery.candidates import Candidate
from compass_ros.discovery.screen import Score, Space, score_force
from compass_ros.discovery.trials import at_other_rates, sketched
from compass_ros.simulation.effects import EFFECTS, Attached
from test.discovery.planted import PUCKS, joint, recorded, recorded_with, space_of

PULSATION = Attached(EFFECTS["pulsating_lift"], PUCKS)
TILT = Attached(EFFECTS["table_tilt"], PUCKS)
SWIRL, FAN = Attached(EFFECTS["swirl"], PUCKS), Attached(EFFECTS["fan_field"], PUCKS)


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


def test_a_field_is_sketched_at_each_of_its_places_and_the_best_sketch_counts() -> None:
    planted = [0.03, -0.05, 0.04, 0.1, 0.5]
    space = space_of(recorded(SWIRL, planted))
    right = score_force(space, Candidate(SWIRL))
    assert right.numbers[1:3] == pytest.approx(planted[1:3], abs=0.03)
    wrong = replace(right, numbers=np.array([-0.01, 0.2, -0.1, 0.03, 0.5]), tangent=np.zeros_like(right.tangent))
    (alone,), (best,) = sketched(space, [wrong]), sketched(space, [replace(wrong, elsewhere=(right,))])
    assert best.fit.point.cost < alone.fit.point.cost - 20.0
    assert best.fit.point.values[-4:-2] == pytest.approx(planted[1:3], abs=0.03)


def test_other_places_gain_nearly_as_much_and_are_no_neighbours() -> None:
    """Two fields: from one place the other is seen."""
    space = space_of(recorded_with([SWIRL, FAN], [0.02, -0.05, 0.04, 0.05, 0.5, 0.02, 0.2, 0.0, 0.05, 0.5]))
    best = score_force(space, Candidate(SWIRL))
    assert best.elsewhere
    for other in best.elsewhere:
        assert 0.5 * best.gain < other.gain <= best.gain
        assert np.any(np.abs(other.numbers - best.numbers)[1:4] > 0.03)

"""What a step of an effect says: of one in proportion to its size, and of one that acts beyond a limit only."""

from __future__ import annotations

import pytest

from compass_ros.calibration.likelihood import Likelihood
from compass_ros.discovery.candidates import Candidate
from compass_ros.discovery.tangents import score
from compass_ros.simulation.effects import EFFECTS, Attached
from test.discovery.planted import recorded, space_of


def excess(likelihood: Likelihood) -> float:
    """Half the sum of squares beyond what noise alone would leave, at the defaults."""
    space = space_of(likelihood)
    return 0.5 * float(space.residual @ space.residual) - 0.5 * likelihood.measurements


def test_a_bias_of_the_heading_is_found_with_its_size() -> None:
    effect = Attached(EFFECTS["heading_bias"], ())
    found = score(space_of(recorded(effect, [0.004])), Candidate(effect))
    assert found.numbers == pytest.approx([0.004], abs=0.0005)


def test_a_limit_that_a_modest_step_does_not_reach_is_found() -> None:
    effect = Attached(EFFECTS["velocity_saturation"], ())
    likelihood = recorded(effect, [2.3, 8.0])
    found = score(space_of(likelihood), Candidate(effect))
    assert found.gain > 0.1 * excess(likelihood) > 20.0
    assert found.numbers[0] == pytest.approx(2.3, rel=0.3)

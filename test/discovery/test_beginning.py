"""An effect that a plain fit cannot follow is found where that begins to fail; a fair fit asks for nothing."""

from __future__ import annotations

import numpy as np
import pytest

from compass_ros.calibration.refine import refine
from compass_ros.discovery.discover import poor
from test.discovery.planted import CALM, HELD_OUT, recorded
from test.simulation.table import simulator

SHOTS = np.concatenate([CALM, HELD_OUT])
ASKED = ("off_centre_mass", "tangential_impulse", "swirl", "camera_scale")


@pytest.mark.slow
def test_a_fair_fit_asks_for_nothing() -> None:
    assert not poor(refine(recorded(None, []), simulator().defaults))

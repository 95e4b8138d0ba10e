"""An effect that a plain fit cannot follow is found where that begins to fail; a fair fit asks for nothing."""

from __future__ import annotations

import numpy as np
import pytest

from compass_ros.calibration.refine import refine
from compass_ros.discovery.beginning import from_the_beginning
from compass_ros.discovery.discover import poor
from compass_ros.simulation.effects import EFFECTS, Attached
from test.discovery.planted import CALM, HELD_OUT, PUCKS, asked_of_table, recorded
from test.simulation.table import simulator

SHOTS = np.concatenate([CALM, HELD_OUT])
ASKED = ("off_centre_mass", "tangential_impulse", "swirl", "camera_scale")


@pytest.mark.slow
def test_a_centre_of_mass_beside_the_centre() -> None:
    """Towards neither axis: from there the fit ends elsewhere."""
    effect = Attached(EFFECTS["off_centre_mass"], PUCKS)
    likelihood = recorded(effect, [-0.002, -0.002, 0.01], SHOTS)
    refined = refine(likelihood, simulator().defaults)
    asked = [c for c in asked_of_table() if c.name in ASKED]
    found = [j for fits in from_the_beginning(simulator(), likelihood, refined.fit, asked) for j in fits]
    best = min(found, key=lambda joint: joint.fit.point.cost)
    assert best.added == (effect,)
    assert best.fit.point.cost < 0.6 * refined.fit.point.cost
    assert abs(best.fit.point.values[-3:-1] - [-0.002, -0.002]).max() < 1e-4


@pytest.mark.slow
def test_a_fair_fit_asks_for_nothing() -> None:
    assert not poor(refine(recorded(None, []), simulator().defaults))

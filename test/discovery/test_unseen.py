"""What a fit at the noise floor does not predict is noticed; what it predicts raises no alarm."""

from __future__ import annotations

from compass_ros.calibration.refine import refine
from compass_ros.discovery.unseen import unexpected
from compass_ros.simulation.effects import EFFECTS, Attached
from test.discovery.planted import HELD_OUT, PUCKS, recorded
from test.simulation.table import simulator


def test_only_shots_on_another_table_are_unexpected() -> None:
    refined = refine(recorded(None, []), simulator().defaults)
    assert refined.chi_square < 1.2
    assert not unexpected(recorded(None, [], HELD_OUT, 1), refined)
    drag = Attached(EFFECTS["viscous_drag"], PUCKS)
    assert unexpected(recorded(drag, [0.3], HELD_OUT, 1), refined)

"""An experiment that is played in the world that asked for it."""

from __future__ import annotations

import pytest

from compass_ros.planning.trials import SHOT
from compass_ros.proof.one_world import SUITES, concealed, next_experiment


@pytest.mark.nightly
def test_a_shot_more_is_calibrated_with_all_others() -> None:
    suite = SUITES["table"]
    with concealed(suite, 710_030) as made:
        assert made.error == ""
        out = made.root / "result"
        out.mkdir()
        given = ["--cell", suite.cell, "--progress", "none", "--out", str(out)]
        assert next_experiment(suite, 710_030, made, out, given) is None
        (out / SHOT).write_text("shots:\n- {x: -0.25, y: 0.05, angle: 0.1, velocity: 0.4}\n", encoding="utf-8")
        found = next_experiment(suite, 710_030, made, out, given)
    assert found is not None
    assert found["error"] is None
    marks = found["marks"]
    assert isinstance(marks, dict)
    assert (marks["kind"], marks["verdict"], marks["right"]) == ("none", "none", True)
    assert found["resolved"] is False  # nothing is named

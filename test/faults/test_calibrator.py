"""The calibrator under fire: killed in the middle of a calibration, doubled."""

from __future__ import annotations

from pathlib import Path

import pytest
from compass_ros_interfaces.msg import CalibrationStatus

from test.nodes.conftest import StartNode
from test.nodes.harness import LATCHED, Probe, until
from test.nodes.recordings import record

pytestmark = [pytest.mark.ros, pytest.mark.slow]

STATUS = "/calibrator/status"


def ended(status: CalibrationStatus) -> bool:
    return status.state not in (CalibrationStatus.IDLE, CalibrationStatus.RUNNING)


def test_a_killed_calibrator_says_so_and_begins_anew(tmp_path: Path, start_node: StartNode, probe: Probe) -> None:
    """`test/faults/kill_calibrator.py` does this 20 times at random moments."""
    bags = tmp_path / "bags"
    record(bags, {"puck1@dyna@friction_sliding": 0.1, "env@camera@bias_x": 0.02}, shots=4, seed=5)
    output = tmp_path / "out" / "result"
    settings = {"bags": [str(bags)], "output": str(output), "rollouts": 600, "seed": 1}
    node = start_node("calibrator", **settings)
    heard = probe.listen(CalibrationStatus, STATUS, LATCHED)
    probe.wait_for(heard, lambda status: status.state == CalibrationStatus.RUNNING and status.share_done > 0)
    second = start_node("calibrator", "-r", "__node:=second", **settings)
    until(lambda: "refused: another calibration" in second.output(), "a second calibrator to be refused")
    assert second.stop() == 0
    node.kill()
    heard.clear()
    anew = start_node("calibrator", **(settings | {"bags": ""}))
    until(lambda: "was cut off in '" in anew.output(), "the new node to know of it")
    assert "iteration" in anew.output()
    assert "; it begins anew" in anew.output()
    done = probe.wait_for(heard, lambda status: ended(status) and "result in" in status.message)
    assert (done.state, done.message) == (CalibrationStatus.SUCCEEDED, f"result in {output}")
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["result"]

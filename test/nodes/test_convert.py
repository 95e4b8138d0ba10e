"""Units and frames of messages are those of the cell: five kinds of cell."""

from __future__ import annotations

from pathlib import Path

import pytest
from std_msgs.msg import Header

from compass_ros.cells import load
from compass_ros.nodes import convert
from compass_ros.operation.current import current
from compass_ros.reporting.result_json import read_result
from test.operation.results import write_calibration

EXAMPLE = Path(__file__).parents[2] / "examples" / "own_cell" / "pendulum.yaml"


@pytest.mark.parametrize(
    ("cell", "unit", "frame"),
    [
        ("air_hockey", "m", "bench"),
        ("bouncing_ball", "m", "bench"),
        ("cube_toss", "m", "bench"),
        ("pendulum_double", "rad", ""),
        (str(EXAMPLE), "rad", ""),
    ],
)
def test_a_pendulum_has_radians_and_no_table(cell: str, unit: str, frame: str, tmp_path: Path) -> None:
    loaded = load(cell)
    found = current(loaded, threads=1).simulator.unit
    assert (found, convert.frame_of(loaded, "bench")) == (unit, frame)
    result = read_result(write_calibration(tmp_path / "result", loaded, {}, unit=found) / "result.json")
    mismatch = convert.mismatch_message(result, Header(frame_id=frame))
    assert {mismatch.unit, *(gap.unit for gap in mismatch.gaps)} == {unit}
    assert convert.status_message(0, unit).unit == unit
    (said, *_) = convert.status_diagnostics(convert.status_message(0, unit), "/n", Header()).status
    assert f"trajectory difference [{unit}]" in {pair.key for pair in said.values}


def test_a_result_of_version_0_1_is_in_metres() -> None:
    assert convert.unit({"gap": {}}) == "m"
    assert convert.left_out({"episodes": {"fit": []}}) == []

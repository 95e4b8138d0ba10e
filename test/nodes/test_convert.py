"""Units and frames of messages are those of the cell: five kinds of cell."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import get_args

import pytest
from compass_ros_interfaces.msg import Explanation, Mismatch
from rclpy.serialization import deserialize_message, serialize_message
from std_msgs.msg import Header

from compass_ros.cells import load
from compass_ros.nodes import convert
from compass_ros.operation.current import current
from compass_ros.reporting.result_json import read_result, to_json
from compass_ros.types import Interval, Verdict
from test.operation.results import write_calibration
from test.reporting.conftest import synthetic_result

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


def same(found: float, expected: float | None) -> bool:
    return math.isnan(found) if expected is None else found == expected


@pytest.mark.parametrize("verdict", get_args(Verdict))
def test_a_mismatch_says_what_the_result_says(verdict: Verdict) -> None:
    """Through the wire, for every verdict: explanations with their laws, numbers and errors; where; the alarm rate."""
    result = to_json(synthetic_result(verdict))
    said = result["mismatch"]
    sent: Mismatch = deserialize_message(serialize_message(convert.mismatch_message(result, Header())), Mismatch)
    assert (sent.verdict, sent.false_alarm, sent.sentence) == (verdict, 0.01, said["sentence"])
    assert len(sent.explanations) == len(said["explanations"])
    for found, one in zip(sent.explanations, said["explanations"], strict=True):
        assert (found.probability, found.log_evidence) == (one["probability"], one["log_evidence"])
        assert [(law.name, list(law.sites)) for law in found.laws] == [
            (law["name"], law["sites"]) for law in one["laws"]
        ]
        for law, expected in zip(found.laws, one["laws"], strict=True):
            told = {q.name: {"value": q.value, "std": q.std, "unit": q.unit} for q in law.quantities}
            assert told == expected["quantities"]
        errors = one["held_out"] or {"before": None, "after": None, "floor": None, "unit": ""}
        for name in ("before", "after", "floor"):
            assert same(getattr(found, f"held_out_{name}"), errors[name])
        assert found.unit == errors["unit"]
    where = said["where"]
    assert sent.phase == (where["phase"] if where else "")
    assert sent.site_kind == ((where["site_kind"] or "") if where else "")
    assert "+".join(sent.sites) == (where["site"].replace("all", "") if where else "")


def test_a_range_is_told_with_its_unit_and_an_older_result_has_none() -> None:
    result = synthetic_result("unknown")
    assert result.mismatch.where is not None
    where = replace(result.mismatch.where, interval=Interval("angle", -0.2, 0.4, "rad"), depends_on="place")
    content = to_json(replace(result, mismatch=replace(result.mismatch, where=where)))
    sent = convert.mismatch_message(content, Header())
    assert (sent.range_of, list(sent.range), sent.range_unit, sent.depends_on) == ("angle", [-0.2, 0.4], "rad", "place")
    for name in ("interval", "depends_on", "site_kind", "site"):
        del content["mismatch"]["where"][name]
    del content["mismatch"]["explanations"], content["mismatch"]["false_alarm"]
    old = convert.mismatch_message(content, Header())
    assert (old.range_of, list(old.range), old.range_unit, old.depends_on) == ("", [0.0, 0.0], "", "")
    assert (list(old.sites), old.site_kind, list(old.explanations)) == ([], "", [])
    assert math.isnan(old.false_alarm)


def test_an_explanation_without_errors_is_not_a_number() -> None:
    sent = convert.explanation_message({"laws": [], "probability": 1.0, "log_evidence": None})
    assert isinstance(sent, Explanation)
    assert all(math.isnan(one) for one in (sent.log_evidence, sent.held_out_before, sent.held_out_floor))

"""result.json: the schema, the round trip, and files that are none."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

import jsonschema
import numpy as np
import pytest

from compass_ros.errors import ConfigError
from compass_ros.reporting.from_json import from_json
from compass_ros.reporting.result_json import read_result, schema, to_json, write_result
from compass_ros.types import EffectParameter, ExplainedLaw, Explanation, Gap, Graph, HeldOut, Result, SiteWord, Verdict

CONTRACT = {
    "": ("schema", "cell", "seed", "versions", "budget", "episodes", "gap", "parameters", "graph", "mismatch"),
    "budget": ("rollouts", "simulated_seconds", "wall_seconds"),
    "episodes": ("used", "fit", "held_out"),
    "gap": ("nominal", "calibrated", "with_effects", "noise_floor_m"),
    "gap.nominal": ("fit", "held_out"),
    "gap.nominal.fit": ("d", "rmse_m"),
    "parameters.0": ("name", "unit", "default", "value", "std", "bounds", "active", "identifiable"),
    "graph": ("parameters", "factors", "psi", "threshold", "sparsity"),
    "mismatch": (
        "verdict", "where", "effects", "undetectable", "next_experiment", "sentence", "explanations", "false_alarm",
    ),
    "mismatch.where": (
        "object", "site_kind", "site", "phase", "channel", "region", "time_s", "interval", "depends_on",
    ),
    "mismatch.where.region": ("centre_m", "radius_m", "frame", "centre", "half_extent"),
    "mismatch.explanations.0": ("laws", "probability", "log_evidence", "held_out"),
    "mismatch.explanations.0.laws.0": ("name", "sites", "quantities"),
    "mismatch.explanations.0.held_out": ("before", "after", "floor", "unit"),
    "mismatch.effects.0": ("name", "parameters", "evidence", "equivalents"),
    "mismatch.effects.0.parameters.strength": ("value", "std", "unit"),
    "mismatch.effects.0.evidence": ("held_out_gain", "log_evidence", "false_alarm_p"),
}  # fmt: skip
"""The fields that the design names, by the path of the object that holds them."""


def holder(content: Any, path: str) -> Any:
    for part in filter(None, path.split(".")):
        content = content[int(part)] if part.isdigit() else content[part]
    return content


def valid(content: object) -> bool:
    return bool(jsonschema.Draft202012Validator(schema()).is_valid(content))


def test_schema_is_a_schema() -> None:
    jsonschema.Draft202012Validator.check_schema(schema())


def test_a_site_is_called_as_in_the_code() -> None:
    words = schema()["$defs"]["where"]["properties"]["site_kind"]["enum"]
    assert set(words) == {*get_args(SiteWord), None}


@pytest.mark.parametrize("verdict", get_args(Verdict))
def test_every_verdict_fits_the_schema(verdict: Verdict, make_result: Callable[[Verdict], Result]) -> None:
    content = to_json(make_result(verdict))
    jsonschema.Draft202012Validator(schema()).validate(content)
    assert content["schema"] == "compass/result/2"
    assert content["mismatch"]["verdict"] == verdict


@pytest.mark.parametrize(("path", "field"), [(path, field) for path, fields in CONTRACT.items() for field in fields])
def test_no_field_of_the_contract_may_miss(path: str, field: str, result: Result) -> None:
    content = to_json(result)
    del holder(content, path)[field]
    assert not valid(content)


@pytest.mark.parametrize(
    ("path", "field", "wrong"),
    [
        ("", "schema", "compass/result/3"),
        ("", "seed", 1.5),
        ("mismatch", "verdict", "perhaps"),
        ("mismatch.where", "phase", "flying"),
        ("mismatch.where", "phase", "strike"),
        ("mismatch.where", "site_kind", "hinge"),
        ("mismatch.explanations.0", "probability", 1.1),
        ("mismatch.explanations.0.held_out", "unit", "mm"),
        ("mismatch.where", "channel", "magic"),
        ("parameters.0", "bounds", [0.0]),
        ("graph", "sparsity", 1.2),
        ("gap.nominal.fit", "rmse_m", -0.1),
        ("mismatch.effects.0.evidence", "false_alarm_p", 2.0),
    ],
)
def test_wrong_values_are_refused(path: str, field: str, wrong: object, result: Result) -> None:
    content = to_json(result)
    holder(content, path)[field] = wrong
    assert not valid(content)


def test_further_fields_are_allowed(result: Result) -> None:
    content = to_json(result)
    for path in CONTRACT:
        holder(content, path)["added_later"] = {"value": 1, "std": 1, "unit": "m"} if path.endswith("parameters") else 1
    assert valid(content)


def test_round_trip(tmp_path: Path, result: Result) -> None:
    path = tmp_path / "deep" / "result.json"
    write_result(result, path)
    content = read_result(path)
    assert content == to_json(result)
    assert content["graph"]["psi"] == result.graph.psi.tolist()
    assert content["gap"]["with_effects"]["held_out"]["rmse_m"] == result.gap["with_effects"]["held_out"].rmse_m
    row = result.parameters[0]
    assert content["parameters"][0]["value"] == row.value
    assert content["parameters"][0]["bounds"] == list(row.bounds)
    assert [p.name for p in path.parent.iterdir()] == ["result.json"]


@pytest.mark.parametrize(
    ("value", "std", "wrong"),
    [
        (1.0, 0.1, False),
        (1.31, 0.1, True),
        (0.69, 0.1, True),
        (1.29, 0.1, False),
        (-2.0, 0.1, True),
        (1.5, float("nan"), False),
        (float("nan"), 0.1, False),
    ],
)
def test_a_parameter_was_wrong_from_three_error_bars(result: Result, value: float, std: float, wrong: bool) -> None:
    row = replace(result.parameters[0], default=1.0, value=value, std=std)
    assert to_json(replace(result, parameters=(row,)))["parameters"][0]["wrong"] is wrong


def test_same_result_same_bytes(tmp_path: Path, result: Result) -> None:
    versions, gap = reversed(list(result.versions.items())), reversed(list(result.gap.items()))
    shuffled = replace(result, versions=dict(versions), gap=dict(gap))
    write_result(result, tmp_path / "a.json")
    write_result(shuffled, tmp_path / "b.json")
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()


def test_what_is_not_finite_or_not_there_is_null(result: Result) -> None:
    row = replace(result.parameters[0], std=float("nan"), value=float("inf"))
    bare = replace(
        result,
        parameters=(row,),
        noise_floor_m=float("nan"),
        gap={"nominal": {"fit": Gap({"puck1": float("nan")}, float("nan"))}},
        graph=Graph((), (), np.zeros((0, 0)), 0.5),
    )
    content = to_json(bare)
    assert content["parameters"][0]["std"] is None
    assert content["parameters"][0]["value"] is None
    assert content["gap"] == {
        "nominal": {"fit": {"d": {"puck1": None}, "rmse_m": None, "signals": {}}, "held_out": None},
        "calibrated": None,
        "with_effects": None,
        "noise_floor_m": None,
        "unit": "m",
    }
    assert content["graph"]["sparsity"] is None
    json.dumps(content, allow_nan=False)
    assert valid(content)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "not valid JSON"),
        ('{"schema": "compass/result/1"', "not valid JSON"),
        ("[1, 2]", "not a compass/result/2"),
        ('{"schema": "other/1"}', "not a compass/result/2"),
        ("[" * 100_000, "not valid JSON"),
    ],
)
def test_a_file_that_is_no_result(tmp_path: Path, text: str, expected: str) -> None:
    path = tmp_path / "result.json"
    path.write_text(text)
    with pytest.raises(ConfigError, match=expected) as caught:
        read_result(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_file_that_is_binary(tmp_path: Path) -> None:
    path = tmp_path / "result.json"
    path.write_bytes(b"\x89PNG\xff\xfe")
    with pytest.raises(ConfigError, match="not valid JSON"):
        read_result(path)


def test_the_message_names_the_field(tmp_path: Path, result: Result) -> None:
    content = to_json(result)
    content["mismatch"]["verdict"] = "perhaps"
    path = tmp_path / "result.json"
    path.write_text(json.dumps(content))
    with pytest.raises(ConfigError, match=r"mismatch\.verdict: 'perhaps' is not one of"):
        read_result(path)


def test_psi_of_the_wrong_shape(tmp_path: Path, result: Result) -> None:
    content = to_json(result)
    content["graph"]["psi"].pop()
    path = tmp_path / "result.json"
    path.write_text(json.dumps(content))
    with pytest.raises(ConfigError, match="expected 64 parameters x 2 factors"):
        read_result(path)


def test_missing_file(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="cannot be read"):
        read_result(tmp_path / "nothing.json")


def test_a_failed_write_leaves_the_old_file(tmp_path: Path, result: Result) -> None:
    path = tmp_path / "result.json"
    path.mkdir()
    with pytest.raises(ConfigError, match="cannot be written"):
        write_result(result, path)
    assert [p.name for p in tmp_path.iterdir()] == ["result.json"]


def test_explanations_read_back(make_result: Callable[[Verdict], Result]) -> None:
    law = ExplainedLaw("coulomb_friction", ("elbow",), {"coefficient": EffectParameter(0.3, 0.01, "N m")})
    unknown = ExplainedLaw("unknown", (), {})
    errors = HeldOut(0.030, 0.011, 0.002, "rad")
    explained = (
        Explanation((law,), 0.9, -12.5, errors),
        Explanation((unknown,), 0.08, -15.0),
        Explanation((), 0.02, -18.0, HeldOut(0.030, 0.030, 0.002, "rad")),
    )
    assert errors.removed == pytest.approx(19 / 28)
    result = make_result("named")
    result = replace(result, mismatch=replace(result.mismatch, explanations=explained, false_alarm=0.01))
    content = json.loads(json.dumps(to_json(result)))
    jsonschema.validate(content, schema())
    assert from_json(content).mismatch.explanations == explained
    assert from_json(content).mismatch.false_alarm == 0.01

"""Marks of results that are right, nearly right and wrong."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from compass_ros.concealed.comparison import compare

EFFECT = {
    "name": "fan_field",
    "outside": False,
    "channel": "dynamics",
    "phases_right": ["free"],
    "channels_right": ["dynamics"],
    "objects_right": ["all", "puck1"],
    "centre_m": [0.02, -0.01],
    "library": {"strength": 0.2, "centre_x": 0.02, "centre_y": -0.01, "radius": 0.1},
    "twins": {},
}
LATENCY = EFFECT | {
    "name": "camera_latency",
    "channel": "sensing",
    "centre_m": None,
    "library": {"latency": 0.01},
    "twins": {"actuation_delay": 1.0},
    "channels_right": ["actuation", "sensing"],
}
TILT = EFFECT | {"name": "table_tilt", "centre_m": None, "library": {"tilt_x": 0.003, "tilt_y": -0.004}}
STRANGE = EFFECT | {
    "name": "ring_bump",
    "outside": True,
    "library": {},
    "nearest": {"name": "swirl", "left_m": 4e-4},
}
WHERE = {"object": "all", "phase": "free", "channel": "dynamics", "region": None, "time_s": None}


def fitted(name: str, equivalents: tuple[str, ...] = (), **quantities: tuple[float, float]) -> dict[str, Any]:
    parameters = {n: {"value": v, "std": s, "unit": "1"} for n, (v, s) in quantities.items()}
    return {"name": name, "parameters": parameters, "evidence": {}, "equivalents": list(equivalents)}


def result(verdict: str, *effects: dict[str, Any], where: dict[str, Any] | None = WHERE) -> dict[str, Any]:
    def gap(rms: float) -> dict[str, Any]:
        return {"fit": None, "held_out": {"d": {}, "rmse_m": rms}}

    return {
        "mismatch": {"verdict": verdict, "where": where, "effects": list(effects)},
        "gap": {"nominal": gap(0.05), "calibrated": gap(0.005), "with_effects": gap(0.002) if effects else None},
        "episodes": {"fit": ["a"], "held_out": ["b", "c"]},
        "parameters": [
            {"name": "p", "value": 1.2, "std": 0.1, "identifiable": True},
            {"name": "q", "value": 9.0, "std": 0.1, "identifiable": False},
        ],
    }


def answer(kind: str, *effects: dict[str, Any]) -> dict[str, Any]:
    return {
        "kind": kind,
        "effects": list(effects),
        "parameters": {"p": 1.0, "q": 0.0},
        "noise_floor_m": {"a": 1.0, "b": 0.001, "c": 0.001},
    }


def test_a_right_name_and_its_numbers() -> None:
    found = fitted(
        "fan_field", strength=(0.22, 0.02), centre_x=(0.03, 0.001), centre_y=(-0.01, 0.001), radius=(0.1, 0.001)
    )
    marks = compare(result("named", found), answer("one", EFFECT))
    assert (marks.right, marks.first_right, marks.misnamed) == (True, True, False)
    assert (marks.object_right, marks.phase_right, marks.channel_right) == (True, True, True)
    assert marks.centre_error_m == pytest.approx(0.01)
    assert [c.name for c in marks.parameters] == ["fan_field.strength", "fan_field.radius"]
    size = (0.2**2 + 0.1**2) ** 0.5  # both have the unit 1 here
    assert marks.parameters[0].error == pytest.approx(0.02 / size)
    assert all(c.covered for c in marks.parameters)
    assert marks.gain == pytest.approx(0.75)
    assert marks.ordinary_z == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("said", "true", "right"),
    [
        ("start", "strike", True),
        ("strike", "strike", True),
        ("contact", "wall_contact", True),
        ("contact", "object_contact", True),
        ("wall_contact", "contact", True),
        ("free", "strike", False),
        ("contact", "free", False),
    ],
)
def test_phases_of_a_table_are_general_ones(said: str, true: str, right: bool) -> None:
    """Answers that were sealed before have a table's words, results of today the general ones."""
    found = result("named", fitted("fan_field"), where=WHERE | {"phase": said})
    assert compare(found, answer("one", EFFECT | {"phases_right": [true]})).phase_right is right


def test_what_the_parameters_leave_of_all_episodes() -> None:
    """Fitted: 3 mm over a noise of 1 mm in one; held out: 5 mm over 1 mm in two."""
    found, truth = result("none"), answer("one", EFFECT)
    assert compare(found, truth).left_m is None, "the fitted ones were not judged"
    found["gap"]["calibrated"]["fit"] = {"d": {}, "rmse_m": 0.003}
    truth["noise_floor_m"]["a"] = 0.001
    assert compare(found, truth).left_m == pytest.approx(1e-3 * np.sqrt((8 + 2 * 24) / 3))
    truth["noise_floor_m"]["a"] = 0.1
    assert compare(found, truth).left_m == 0.0, "less than the noise"


@pytest.mark.parametrize(
    ("verdict", "effects", "truth", "right", "misnamed"),
    [
        ("named", (fitted("swirl"),), EFFECT, False, True),
        ("none", (), EFFECT, False, False),
        ("unknown", (), EFFECT, False, False),
        ("not_evaluated", (), EFFECT, False, False),
        ("named", (fitted("actuation_delay"),), LATENCY, True, False),
        ("ambiguous", (fitted("camera_latency", ("actuation_delay",)),), LATENCY, True, False),
        ("ambiguous", (fitted("fan_field", ("swirl",)),), EFFECT, False, False),
        ("ambiguous", (fitted("swirl", ("magnus",)),), EFFECT, False, True),
        ("named", (fitted("fan_field"), fitted("magnus")), EFFECT, False, True),
    ],
)
def test_one_effect(verdict: str, effects: Any, truth: dict[str, Any], right: bool, misnamed: bool) -> None:
    marks = compare(result(verdict, *effects), answer("one", truth))
    assert (marks.right, marks.misnamed) == (right, misnamed)


def test_the_first_name_is_judged_only_where_the_class_has_one_member() -> None:
    assert compare(result("named", fitted("actuation_delay")), answer("one", LATENCY)).first_right is None
    assert compare(result("named", fitted("swirl")), answer("one", EFFECT)).first_right is False


@pytest.mark.parametrize(
    ("effects", "right", "misnamed"),
    [
        (("table_tilt", "fan_field"), True, False),
        (("fan_field", "table_tilt"), True, False),
        (("fan_field",), False, False),
        (("fan_field", "swirl"), False, True),
        (("fan_field", "fan_field"), False, False),
    ],
)
def test_two_effects(effects: tuple[str, ...], right: bool, misnamed: bool) -> None:
    marks = compare(result("named", *map(fitted, effects)), answer("two", EFFECT, TILT))
    assert (marks.right, marks.misnamed) == (right, misnamed)


def test_nothing_missing() -> None:
    assert compare(result("none", where=None), answer("none")).right
    alarm = compare(result("named", fitted("magnus")), answer("none"))
    assert (alarm.right, alarm.misnamed) == (False, True)
    assert compare(result("none", where=None), answer("none")).gain is None


def test_something_from_outside() -> None:
    region = {"centre_m": [0.02, 0.0], "radius_m": 0.1}
    marks = compare(result("unknown", where=WHERE | {"region": region}), answer("outside", STRANGE))
    assert (marks.right, marks.misnamed, marks.first_right) == (True, False, None)
    assert marks.centre_error_m == pytest.approx(0.01)
    assert marks.apart_m == pytest.approx(4e-4)
    assert compare(result("named", fitted("fan_field")), answer("outside", STRANGE)).misnamed


def test_components_of_one_vector_share_their_size() -> None:
    """A small component is not judged by itself."""
    found = fitted("table_tilt", tilt_x=(0.0031, 5e-5), tilt_y=(-0.004, 5e-5))
    checks = compare(result("named", found), answer("one", TILT)).parameters
    assert [c.error for c in checks] == [pytest.approx(0.02), pytest.approx(0.0)]
    assert [c.covered for c in checks] == [False, True]


def test_place_and_phase_of_a_twin_are_right_too() -> None:
    there = WHERE | {"channel": "actuation", "object": "puck2"}
    marks = compare(result("named", fitted("actuation_delay"), where=there), answer("one", LATENCY))
    assert (marks.channel_right, marks.object_right) == (True, False)

"""Results beside answers of worlds from other engines, and the table of their marks."""

from __future__ import annotations

from typing import Any

import pytest

from compass_ros.proof.marks import judge
from compass_ros.proof.scenes_table import predictions, reliability, rows


def law(name: str, classes: list[str], strength: float = 5.0, sites: tuple[str, ...] = ("elbow",)) -> dict[str, Any]:
    return {"name": name, "class": classes, "sites": list(sites), "strength": strength}


def answer(kind: str, *laws: dict[str, Any]) -> dict[str, Any]:
    return {"kind": kind, "laws": list(laws), "strength": max([0.0, *(one["strength"] for one in laws)])}


def explanation(probability: float, *names: str, sites: tuple[str, ...] = ("elbow",)) -> dict[str, Any]:
    laws = [{"name": name, "sites": list(sites), "quantities": {}} for name in names]
    return {"laws": laws, "probability": probability, "held_out": {"before": 3.0, "after": 1.2, "floor": 1.0}}


def result(verdict: str, *explanations: dict[str, Any]) -> dict[str, Any]:
    return {"mismatch": {"verdict": verdict, "explanations": list(explanations), "false_alarm": 0.01}}


LUGRE = law("lugre", ["stribeck_friction", "coulomb_friction"])
BELT = law("belt", ["joint_elasticity"], sites=("shoulder",))
FAINT = law("felt", ["quadratic_drag"], strength=0.7)
ODD = law("loose_base", ["unknown"])
NAMED = result("named", explanation(0.995, "stribeck_friction"), explanation(0.005))
STRIBECK, COULOMB = "stribeck_friction", "coulomb_friction"
CASES: dict[str, tuple[dict[str, Any], dict[str, Any], bool, bool]] = {
    "in its class": (answer("one", LUGRE), NAMED, True, False),
    "another law": (answer("one", BELT), NAMED, False, True),
    "silent": (answer("one", LUGRE), result("none", explanation(1.0)), False, False),
    "one too many": (answer("one", LUGRE), result("named", explanation(1.0, STRIBECK, "spring")), False, True),
    "twice one class": (
        answer("one", LUGRE),
        result("named", explanation(1.0, STRIBECK, COULOMB)),
        True,
        False,
    ),
    "on three joints": (answer("one", LUGRE), result("named", explanation(1.0, *3 * [STRIBECK])), True, False),
    "both of two": (
        answer("two", LUGRE, BELT),
        result("named", explanation(1.0, "joint_elasticity", COULOMB)),
        True,
        False,
    ),
    "one of two": (answer("two", LUGRE, BELT), NAMED, False, False),
    "one of two, the other faint": (answer("two", LUGRE, FAINT), NAMED, True, False),
    "a faint one not seen": (answer("one", FAINT), result("none", explanation(1.0)), True, False),
    "a faint one seen": (answer("one", FAINT), result("named", explanation(1.0, "quadratic_drag")), True, False),
    "a faint one called unknown": (answer("one", FAINT), result("unknown", explanation(1.0, "unknown")), False, False),
    "nothing": (answer("none"), result("none", explanation(1.0)), True, False),
    "a false alarm": (answer("none"), NAMED, False, True),
    "from outside": (answer("outside", ODD), result("unknown", explanation(1.0, "unknown")), True, False),
    "from outside, named": (answer("outside", ODD), NAMED, False, True),
    "open within the class": (
        answer("one", LUGRE),
        result("ambiguous", explanation(0.6, STRIBECK), explanation(0.395, COULOMB), explanation(0.005)),
        True,
        False,
    ),
    "open beyond it": (
        answer("one", LUGRE),
        result("ambiguous", explanation(0.6, STRIBECK), explanation(0.4, "spring")),
        False,
        True,
    ),
    "no verdict": (answer("none"), result("fit_failed"), False, False),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_a_result_is_right_or_not_and_misnamed_or_not(case: str) -> None:
    true, said, right, misnamed = CASES[case]
    found = judge(said, true)
    assert (found.right, found.misnamed) == (right, misnamed)


@pytest.mark.parametrize(("sites", "right"), [(("elbow",), True), (("elbow", "wrist"), False), ((), True)])
def test_the_site_is_judged_where_the_law_is_named(sites: tuple[str, ...], right: bool) -> None:
    said = result("named", explanation(1.0, "stribeck_friction", sites=sites))
    assert judge(said, answer("one", LUGRE)).sites_right is right


def test_what_acts_on_the_world_acts_on_all_of_it() -> None:
    """A base that is not level tilts gravity for every link: the answer says the world, and the law the links."""
    said = result("named", explanation(1.0, "gravity_tilt", sites=("upper_arm", "forearm")))
    tilted = law("tilted_base", ["gravity_tilt"], sites=("world",))
    assert judge(said, answer("one", tilted)).sites_right is True


@pytest.mark.parametrize(
    ("pairs", "right"),
    [([("plate2", "ball")], True), ([("plate1", "ball")], False), ([("plate2", "ball"), ("plate1", "ball")], False)],
)
def test_a_law_between_two_things_is_on_the_one_that_is_true(pairs: list[tuple[str, ...]], right: bool) -> None:
    said = result("named", explanation(1.0, *["adhesion"] * len(pairs)))
    for law, sites in zip(said["mismatch"]["explanations"][0]["laws"], pairs, strict=True):
        law["sites"] = list(sites)
    sticky = {"name": "adhesion", "class": ["adhesion"], "sites": ["plate2"], "strength": 5.0}
    assert judge(said, answer("one", sticky)).sites_right is right


def test_what_the_laws_remove_is_counted_above_the_floor() -> None:
    assert judge(NAMED, answer("one", LUGRE)).gain == pytest.approx(0.9)


def test_probabilities_are_marked_one_by_one() -> None:
    assert judge(NAMED, answer("one", LUGRE)).probabilities == ((0.995, True), (0.005, False))


def line(case: str, seconds: float = 60.0) -> dict[str, Any]:
    true, said, _, _ = CASES[case]
    return {"suite": "table", "error": None, "seconds": {"calibrate": seconds}, "marks": judge(said, true).as_json()}


def test_the_table_counts_clear_and_faint_worlds_apart() -> None:
    cases = ["in its class", "another law", "a faint one not seen", "nothing", "from outside", "one of two"]
    found = {row.what.split(":")[0]: row for row in rows([line(case) for case in cases])}
    assert found["one law, at least twice the noise"].count == "1 of 2"
    assert found["one law, faint ones included"].count == "2 of 3"
    assert found["nothing missing"].reached is True
    assert found["two laws"].count == "0 of 1"


def test_a_world_that_failed_counts_as_wrong() -> None:
    failed = {"suite": "table", "error": "calibrate: status 1", "kind": "none", "truth": []}
    found = {row.what.split(":")[0]: row for row in rows([line("nothing"), failed])}
    assert found["nothing missing"].count == "1 of 2"


def test_experiments_that_were_played_are_counted() -> None:
    """Not those that no world plays."""
    played: list[dict[str, Any]] = [
        {"next_experiment": {"error": None, "resolved": resolved}} for resolved in (True, False, True)
    ]
    every = [line("nothing") | one for one in (*played, {"next_experiment": None}, {})]
    found = {row.what: row for row in rows(every)}
    assert found["one proposed experiment resolves an ambiguous verdict"].count == "2 of 3"


def test_probabilities_that_are_right_as_often_as_they_say_are_calibrated() -> None:
    pairs = [(0.9, i < 9) for i in range(10)] + [(0.1, i < 1) for i in range(10)]
    assert all(abs(p - share) < 1e-12 for p, share, _ in reliability(pairs))
    assert reliability([(1.0, True)]) == [(1.0, 1.0, 1)]


def test_of_several_right_answers_one_is_true() -> None:
    """A faint law: `none` at 0.7 and its name at 0.2 are sure to 0.9, and neither of them is a wrong 0.3 or 0.8."""
    assert predictions([(0.7, True), (0.2, True), (0.1, False)]) == [(pytest.approx(0.9), True), (0.1, False)]
    assert predictions([(0.6, False), (0.4, False)]) == [(0.6, False), (0.4, False)]

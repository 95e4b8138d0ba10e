"""The ranking of explanations: in the order and with the numbers of the result, and why others are not the first."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import get_args

import pytest

from compass_ros.reporting import ReportExtras
from compass_ros.reporting.report import render
from compass_ros.reporting.view.explanations import ranked, why_less
from compass_ros.reporting.view.gap import signals
from compass_ros.reporting.words import where_rows
from compass_ros.types import (
    ExplainedLaw,
    Explanation,
    Gap,
    HeldOut,
    Mismatch,
    Result,
    SignalGap,
    SiteWord,
    Verdict,
    Where,
)
from test.reporting.conftest import effect
from test.reporting.test_diagnosis import printed


def model(laws: dict[str, tuple[str, ...]], probability: float, after: float, log_evidence: float = 0.0) -> Explanation:
    said = tuple(ExplainedLaw(name, sites, {}) for name, sites in laws.items())
    return Explanation(said, probability, log_evidence, HeldOut(0.030, after, 0.002, "rad"))


def weighed(*explanations: Explanation, alpha: float = 0.01) -> Mismatch:
    return Mismatch("named", None, (), (), "", "", explanations, alpha)


def test_rows_have_the_numbers_of_the_result_in_its_order() -> None:
    rows = ranked(
        weighed(
            model({"stribeck_friction": ("elbow", "wrist"), "backlash": ("wrist",)}, 0.9, 0.002),
            model({"coulomb_friction": ("elbow",)}, 0.08, 0.016),
            replace(model({"unknown": ()}, 0.0195, 0.03), held_out=None),
            model({}, 0.0004, 0.030),
            model({"camera_latency": ()}, 0.0001, 0.044),
        )
    )
    assert [row.name for row in rows] == [
        "stribeck_friction on elbow, wrist + backlash on wrist",
        "coulomb_friction on elbow",
        "no law that is known",
        "nothing is missing",
        "camera_latency",
    ]
    assert [row.share for row in rows] == [90.0, 8.0, 1.9, 0.0, 0.0]
    assert [row.removed for row in rows] == [100.0, 50.0, 0.0, 0.0, 0.0]
    assert [row.removes for row in rows][1:] == ["50\u202f%", "\u2013", "\u2013", "\u221250\u202f%"]
    assert [row.errors.replace("\u202f", " ") for row in rows] == [
        "30.0 \u2192 2.00 mrad", "30.0 \u2192 16.0 mrad", "", "30.0 mrad", "30.0 \u2192 44.0 mrad",
    ]  # fmt: skip
    assert [row.kept for row in rows] == [True, True, True, False, False], "these hold 0.99"


def test_what_corrects_a_form_is_told_and_is_no_explanation(make_result: Callable[..., Result]) -> None:
    result = make_result("named")
    first, *others = ranked(result.mismatch)
    assert first.name == "fan_field on puck1"
    assert first.notes == ["with swirl on puck1 as a correction of its form, as published forms of one law differ"]
    assert not any(row.form for row in others)
    assert first.notes[0].replace("'", "&#39;") in render(result, ReportExtras())
    assert first.notes[0] in " ".join(printed(result, ReportExtras()).split())


@pytest.mark.parametrize(
    ("worse", "odds", "said"),
    [
        (math.log(25), 25.0, "25 times less probable"),
        (6 * math.log(10), 1e6, "10\u2076 times less probable"),
        (300 * math.log(10), 1e300, "10\u00b3\u2070\u2070 times less probable"),
        (math.log(4), 4.0, "4 times less probable"),
        (0.1, 40.0, "explains the recordings as well, but was less probable before"),
        (-2.0, 9.0, "explains the recordings as well, but was less probable before"),
        (math.log(2), 2.0, ""),
        (0.0, 1.0, ""),
        (math.nan, 50.0, ""),
    ],
)
def test_why_one_is_less_probable(worse: float, odds: float, said: str) -> None:
    first = model({"spring": ("elbow",)}, 0.5, 0.002, log_evidence=100.0)
    why = why_less(model({"backlash": ("elbow",)}, 0.5 / odds, 0.002, log_evidence=100.0 - worse), first)
    assert said in why
    assert bool(why) is bool(said)
    assert why_less(first, first) == ""


@pytest.mark.parametrize("verdict", get_args(Verdict))
def test_report_and_terminal_show_the_ranking(make_result: Callable[[Verdict], Result], verdict: Verdict) -> None:
    result = make_result(verdict)
    page, text = render(result, ReportExtras()), printed(result, ReportExtras())
    rows = ranked(result.mismatch)
    assert ("What could explain it" in page) is ("What could explain it" in text) is bool(rows)
    for row in rows:
        assert row.why in page
        assert f"width:{row.share}%" in page
        assert f"width:{row.removed}%" in page
        assert row.probability in text
        assert all(f"<code>{name}</code>" in page and name in text for name, _ in row.laws)


def test_a_law_on_two_sites_is_told_with_its_site(result: Result) -> None:
    """What is asymmetric on the elbow and what on the shoulder; another explanation's sites are not theirs."""
    name = "asymmetric_friction"
    of = [ExplainedLaw(name, (joint,), effect(name).parameters) for joint in ("elbow", "shoulder")]
    both = Explanation(tuple(of), 0.9, 0.0, HeldOut(0.030, 0.002, 0.002, "rad"))
    mismatch = weighed(model({"spring": ("wrist",)}, 0.05, 0.02), both)
    told = replace(result, mismatch=replace(mismatch, effects=(effect(name), effect(name)), sentence="."))
    page, text = render(told, ReportExtras()), printed(told, ReportExtras())
    for joint in ("elbow", "shoulder"):
        assert f'<p class="effect-name">{name} on {joint}</p>' in page
        assert f"{name} on {joint} removes" in text
    without = replace(told, mismatch=replace(told.mismatch, explanations=()))
    assert f'<p class="effect-name">{name}</p>' in render(without, ReportExtras())


def test_names_of_laws_are_no_markup(result: Result) -> None:
    hostile = weighed(model({"<i>[red]x": ("</td><script>",)}, 1.0, 0.002))
    bad = replace(result, mismatch=replace(hostile, sentence="."))
    assert "<i>[" not in (page := render(bad, ReportExtras()))
    assert "</td><script>" not in page
    assert "<i>[red]x on </td><script>" in printed(bad, ReportExtras())


@pytest.mark.parametrize("held_out", [True, False])
def test_errors_by_signal_have_joints_and_floors(result: Result, held_out: bool) -> None:
    def gap(scale: float) -> Gap:
        joints = SignalGap(0.02 * scale, "rad", 0.002, {"elbow": 0.01 * scale, "wrist": 0.03 * scale})
        return Gap({}, 1.0, {"joints": joints, "force": SignalGap(0.5 * scale, "N", 0.0)})

    parts = ("fit", "held_out") if held_out else ("fit",)
    of_models = {"nominal": 1.0, "calibrated": 0.5}
    told = replace(result, gap={m: dict.fromkeys(parts, gap(s)) for m, s in of_models.items()})  # type: ignore[arg-type, misc]
    shown = signals(told)
    assert [(row["name"], row["unit"], row["floor"]) for row in shown["rows"]] == [
        ("joints", "mrad", "2.00"), ("elbow", "mrad", "2.00"), ("wrist", "mrad", "2.00"), ("force", "N", "\u2013"),
    ]  # fmt: skip
    assert [row["numbers"][:2] for row in shown["rows"]] == [
        ["20.0", "10.0"], ["10.0", "5.00"], ["30.0", "15.0"], ["0.5", "0.25"],
    ]  # fmt: skip
    assert shown["on"] == ("episodes that were never fitted" if held_out else "the fitted episodes")
    for row in shown["rows"][:3]:
        nominal, calibrated = (dot["place"] for dot in row["dots"])
        assert shown["floor"] < calibrated < nominal
    assert shown["rows"][3]["dots"] == [], "no floor: no place in floors"


@pytest.mark.parametrize(
    ("kind", "site", "said"),
    [
        ("joint", "elbow", "joint elbow"),
        ("joint", "elbow+wrist", "joints elbow, wrist"),
        ("body", "all", "all bodies"),
        ("geom_pair", "puck+wall", "contacts of puck and wall"),
        ("geom_pair", "all", "all contacts"),
        ("body_pair", "puck1+puck2", "pair of puck1 and puck2"),
        ("actuator", "servo", "actuator servo"),
        ("signal", "all", "all signals"),
    ],
)
def test_a_site_in_words(kind: SiteWord, site: str, said: str) -> None:
    rows = dict(where_rows(Where("all", "contact", "contact", site_kind=kind, site=site), "m"))
    assert (rows["site"], rows["phase"], "object" in rows) == (said, "in contacts", False)

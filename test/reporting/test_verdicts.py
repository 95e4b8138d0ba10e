"""A verdict in words: a headline is short and true, and nothing of the sentence is lost."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest

from compass_ros.discovery.finding import not_evaluated
from compass_ros.reporting import ReportExtras
from compass_ros.reporting.report import render
from compass_ros.reporting.verdicts import headline, meaning, title
from compass_ros.reporting.words import VERDICT_MEANING
from compass_ros.types import Mismatch, Result
from test.reporting.test_report import Outline

GAP = "held-out error 24.98 mrad, floor 0.41 mrad."
BEST = (
    "probability 1.00; the best law, eccentricity(joints.elbow_flex) + eccentricity(joints.wrist_flex), has 0 and "
    "leaves 4.2 of 4.6 times the noise in fitted episodes"
)
NUMERICS = "No verdict: 100 % of what is left goes away with half the time step (0.5 ms)."
SIZES = "clock_drift, rate -0.0119 +- 0.0002"


@pytest.mark.parametrize(
    ("sentence", "head", "rest"),
    [
        (
            f"Throughout, something differs that no known law explains ({BEST}); {GAP}",
            "Throughout, something differs that no known law explains.",
            f"P{BEST[1:]}; {GAP}",
        ),
        (
            f"Throughout, the simulator lacks one of these: clock_drift; buoyancy(ball); {SIZES}; {GAP}",
            "Throughout, the simulator lacks one of several laws.",
            f"one of these: clock_drift; buoyancy(ball); {SIZES}; {GAP}",
        ),
        (
            f"On free slides, within 6 cm of (-0.07, -0.11), the simulator lacks a push around a point; swirl; {GAP}",
            "On free slides, within 6 cm of (-0.07, -0.11), the simulator lacks a push around a point.",
            f"swirl; {GAP}",
        ),
        (
            f"{NUMERICS} That is the simulator's own numerics.",
            NUMERICS,
            "That is the simulator's own numerics.",
        ),
        (f"Nothing is missing that these recordings could show: {GAP}",) * 2 + ("",),
        ("word " * 30 + "end.",) * 2 + ("",),
    ],
)
def test_a_long_sentence_has_a_short_head(sentence: str, head: str, rest: str) -> None:
    assert headline(Mismatch("unknown", None, (), (), "", sentence)) == (head, rest)


def test_the_page_has_the_head_in_large_type_and_the_rest_below(result: Result) -> None:
    sentence = f"Throughout, something differs that no known law explains ({BEST}); {GAP}"
    page = render(replace(result, mismatch=Mismatch("unknown", None, (), (), "", sentence)), ReportExtras())
    (large,) = re.findall("<h1>(.*?)</h1>", page)
    (below,) = re.findall('<p class="rest">(.*?)</p>', page)
    assert large == "Throughout, something differs that no known law explains."
    assert below == f"P{BEST[1:]}; {GAP}"


def test_a_search_that_runs_is_not_one_that_nobody_began(result: Result) -> None:
    running = not_evaluated("the search has not ended").mismatch
    said = Outline(render(replace(result, mismatch=running), ReportExtras())).said()
    assert "The search for missing physics has not ended." in said
    assert "Nobody looked" not in said
    assert title(running) == "Not evaluated yet"


def test_a_search_that_was_switched_off_is(result: Result) -> None:
    off = not_evaluated("it was switched off").mismatch
    assert meaning(off) == VERDICT_MEANING["not_evaluated"]
    assert title(off) == "Not evaluated"
    assert headline(off) == (off.sentence, "")

"""The table of worlds from other engines: by scene, and over all."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from compass_ros.proof.lines import Line, kind_of, mark_of, marks_of
from compass_ros.proof.statistics import Row, at_least, medians

BINS = np.linspace(0, 1, 6)
"""Of the reliability of probabilities."""


def rows(found: Sequence[Line]) -> list[Row]:
    """For the worlds of one scene, or of several. A world whose run failed counts as wrong."""
    of = {kind: [x for x in found if kind_of(x) == kind] for kind in ("one", "two", "none", "outside")}
    clear = {kind: [x for x in among if not mark_of(x, "faint")] for kind, among in of.items()}
    sited = [x for x in of["one"] if mark_of(x, "sites_right") is not None]
    pairs = [pair for x in found for pair in predictions(marks_of(x).get("probabilities", ()))]
    gains = [mark_of(x, "gain") for x in of["one"] + of["two"] if mark_of(x, "gain") is not None]
    seconds = [x["seconds"]["calibrate"] for x in found if x.get("seconds")]
    return [
        at_least("one law, at least twice the noise: named right or within its class", _is(clear["one"], "right"), 0.9),
        at_least("one law, faint ones included: the name, or `none` where it is faint", _is(of["one"], "right"), 0.8),
        at_least("nothing missing: `none`", _is(of["none"], "right"), 0.97),
        at_least("from outside: `unknown`, or a name that its class allows", _is(of["outside"], "right"), 0.85),
        at_least("from outside: misnamed", _is(of["outside"], "misnamed"), 0.05, most=True),
        at_least("one law: misnamed", _is(of["one"], "misnamed"), 0.05, most=True),
        at_least("site right where named", _is(sited, "sites_right"), 0.95),
        at_least("two laws: both", _is(clear["two"], "right"), 0.65),
        medians("share of the excess held-out error removed, median", gains, 0.9),
        at_least("one proposed experiment resolves an ambiguous verdict", _resolved(found), 0.7),
        _calibration(pairs),
        Row("Brier score of the probabilities", "-", _brier(pairs), "-", str(len(pairs)), None),
        Row("calibration and discovery, median [s]", "-", _median(seconds), "-", str(len(seconds)), None),
    ]


def _resolved(found: Sequence[Line]) -> list[bool]:
    """Of ambiguous verdicts that proposed what a world can play."""
    return [bool(x["next_experiment"]["resolved"]) for x in found if x.get("next_experiment")]


def predictions(explanations: Sequence[tuple[float, bool]]) -> list[tuple[float, bool]]:
    """Of one world, from the probability of each explanation and whether it is a right answer: that one of the right
    answers is true is one prediction, and each other explanation is one."""
    wrong = [(p, False) for p, right in explanations if not right]
    if len(wrong) == len(explanations):
        return wrong
    return [(min(sum(p for p, right in explanations if right), 1.0), True), *wrong]


def reliability(pairs: Sequence[tuple[float, bool]]) -> list[tuple[float, float, int]]:
    """Mean probability, share that is right, and how many, of each bin that holds some."""
    p, right = np.array([a for a, _ in pairs]), np.array([b for _, b in pairs], float)
    which = np.clip(np.digitize(p, BINS) - 1, 0, len(BINS) - 2)
    own = [which == i for i in range(len(BINS) - 1)]
    return [(float(p[o].mean()), float(right[o].mean()), int(o.sum())) for o in own if o.any()]


def _calibration(pairs: Sequence[tuple[float, bool]]) -> Row:
    """Expected calibration error (Naeini, Cooper, Hauskrecht 2015): mean distance of a bin, weighted by its size."""
    what = "expected calibration error of the probabilities"
    if not pairs:
        return Row(what, "<= 0.05", "-", "-", "0", None)
    error = sum(abs(p - share) * count for p, share, count in reliability(pairs)) / len(pairs)
    return Row(what, "<= 0.05", f"{error:.3f}", "-", str(len(pairs)), error <= 0.05)


def _brier(pairs: Sequence[tuple[float, bool]]) -> str:
    return f"{np.mean([(p - right) ** 2 for p, right in pairs]):.3f}" if pairs else "-"


def _median(values: Sequence[float]) -> str:
    return f"{np.median(values):.0f}" if values else "-"


def _is(among: Sequence[Line], mark: str) -> list[bool]:
    return [bool(mark_of(line, mark)) for line in among]

"""The table of the proof: what had to be reached, what was, and how sure that is."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import binomtest, bootstrap

from compass_ros.proof.lines import Line, kind_of, mark_of, marks_of

_LEVEL = 0.95
_CENTRE_M = 0.02
_APART_M = 1e-3
_FELT_M = 1e-3
"""What the parameters must leave of each effect, rms, for a world to be judged [m], except in the suite `small`. Where
a law's bounds end before, it is weaker than it was asked to be."""
_LOWER = {"tracker": 0.05}
"""By how much a suite may stay below the main suite's shares."""
_TWO_CORES = {"jobs": 1, "threads": 2}
"""How a world must have been run for its time to count."""


@dataclass(frozen=True)
class Row:
    """One line of the table."""

    what: str
    bar: str
    value: str
    interval: str
    count: str
    reached: bool | None
    """None: nothing to judge by."""


def table(found: Sequence[Line]) -> list[Row]:
    """The rows for the worlds of one suite and method. A world whose run failed counts as wrong, never as missing."""
    suite = str(found[0]["suite"]) if found else "main"
    if suite == "small":
        return _small(found)
    lower = _LOWER.get(suite, 0.0)
    judged = [x for x in found if felt(x)]
    one, two, none, outside = ([x for x in judged if kind_of(x) == kind] for kind in ("one", "two", "none", "outside"))
    alone = [x for x in one if mark_of(x, "first_right") is not None and mark_of(x, "right")]
    apart = [x for x in outside if (mark_of(x, "apart_m") or 0.0) >= _APART_M]
    checks = [c for x in judged for c in marks_of(x).get("parameters", ())]
    errors = [mark_of(x, "centre_error_m") for x in one if mark_of(x, "right")]
    centres = [error for error in errors if error is not None]
    gains = [mark_of(x, "gain") for x in one + two if mark_of(x, "gain") is not None]
    return [
        _share("one effect, named right or within its class", one, "right", 0.95 - lower),
        _share("of these, first name right where the class has one member", alone, "first_right", 0.95 - lower),
        _share("two effects, both named or within their classes", two, "right", 0.75 - lower),
        _share("nothing missing: none", none, "right", 0.97 - lower),
        _share("outside the library: unknown", outside, "right", 0.90 - lower),
        _share("of these, where no formula of the library comes within 1 mm rms", apart, "right", 0.90 - lower),
        _where("outside the library: object, phase and channel right", outside, 0.90 - lower),
        _share("outside the library: misnamed", outside, "misnamed", 0.03, most=True),
        _share("one effect: misnamed", one, "misnamed", 0.03, most=True),
        _where("one effect: object, phase and channel right", one, 0.97 - lower),
        at_least(f"centre within {100 * _CENTRE_M:.0f} cm", [c <= _CENTRE_M for c in centres], 0.97 - lower),
        medians("parameters of effects: median error", [c["error"] for c in checks], 0.05, most=True),
        _between("parameters of effects: 90 % intervals hold the truth", [c["covered"] for c in checks], 0.80, 0.97),
        medians("share of the excess held-out error removed, median", gains, 0.9 - lower),
        *_times(found),
        Row("left out above: an effect below 1 mm rms", "-", str(len(found) - len(judged)), "-", str(len(found)), None),
    ]


def _small(found: Sequence[Line]) -> list[Row]:
    """Effects of 0.5 mm: seldom a wrong name; where the right one is not found, silence or doubt."""
    missed = [line for line in found if not mark_of(line, "right")]
    modest = [mark_of(line, "verdict") in ("none", "ambiguous") and not mark_of(line, "misnamed") for line in missed]
    return [
        _share("one effect, named right or within its class", found, "right", 0.80),
        at_least("of the others: `none` or `ambiguous`", modest, 1.0),
        _share("one effect: misnamed", found, "misnamed", 0.03, most=True),
        *_times(found),
    ]


def felt(line: Line) -> bool:
    """Whether each effect moves the pucks enough: by its size in the answer, and by what the calibration leaves."""
    sizes = [effect["rms_m"] for effect in line.get("effects") or ()]
    if sizes and (left := mark_of(line, "left_m")) is not None:
        sizes.append(left)
    return line["suite"] == "small" or min(sizes, default=_FELT_M) >= _FELT_M


def wilson(outcomes: Sequence[bool]) -> str:
    """Interval of the share of True (Wilson 1927), as in '83 to 99 %'."""
    interval = binomtest(int(np.sum(outcomes)), len(outcomes)).proportion_ci(_LEVEL, method="wilson")
    return f"{100 * interval.low:.0f} to {100 * interval.high:.0f} %"


def _share(what: str, among: Sequence[Line], mark: str, bar: float, most: bool = False) -> Row:
    return at_least(what, [bool(mark_of(line, mark)) for line in among], bar, most)


def _where(what: str, among: Sequence[Line], bar: float) -> Row:
    names = ("object_right", "phase_right", "channel_right")
    return at_least(what, [all(mark_of(line, name) for name in names) for line in among], bar)


def at_least(what: str, outcomes: Sequence[bool], bar: float, most: bool = False) -> Row:
    """Share of True with Wilson's interval."""
    text = f"{'<=' if most else '>='} {100 * bar:.0f} %"
    if not outcomes:
        return Row(what, text, "-", "-", "0", None)
    hits, count = int(np.sum(outcomes)), len(outcomes)
    share = hits / count
    reached = share <= bar if most else share >= bar
    return Row(what, text, f"{100 * share:.3g} %", wilson(outcomes), f"{hits} of {count}", reached)


def _between(what: str, outcomes: Sequence[bool], low: float, high: float) -> Row:
    row = at_least(what, outcomes, low)
    share = float(np.mean(outcomes)) if outcomes else np.nan
    reached = bool(low <= share <= high) if outcomes else None
    return Row(what, f"{100 * low:.0f} to {100 * high:.0f} %", row.value, row.interval, row.count, reached)


def medians(what: str, values: Sequence[float], bar: float, most: bool = False) -> Row:
    """Median with a bootstrap interval; shares as per cent."""
    return _of_medians(what, values, bar, most, lambda x: f"{100 * x:.1f} %")


def _times(found: Sequence[Line]) -> list[Row]:
    """Of calibration and discovery: worlds that had two cores to themselves are judged, the others shown."""
    timed = [line for line in found if line.get("seconds")]
    alone = [line["seconds"]["calibrate"] for line in timed if _alone(line)]
    shared = [line["seconds"]["calibrate"] for line in timed if not _alone(line)]
    rows = [_of_medians("calibration and discovery on two cores, median [s]", alone, 90.0, True, _whole)]
    if shared:
        row = _of_medians("the same, run in other ways, median [s]", shared, 0.0, True, _whole)
        rows.append(replace(row, bar="-", reached=None))
    return rows


def _alone(line: Line) -> bool:
    return all(line.get(name) == value for name, value in _TWO_CORES.items())


def _whole(seconds: float) -> str:
    return f"{seconds:.0f}"


def _of_medians(what: str, values: Sequence[float], bar: float, most: bool, shown: Callable[[float], str]) -> Row:
    text = f"{'<=' if most else '>='} {shown(bar)}"
    if not values:
        return Row(what, text, "-", "-", "0", None)
    middle = float(np.median(values))
    limits = "-"
    if len(set(values)) > 1:
        spread = bootstrap((np.asarray(values),), np.median, confidence_level=_LEVEL, method="percentile", rng=0)
        limits = f"{shown(spread.confidence_interval.low)} to {shown(spread.confidence_interval.high)}"
    return Row(what, text, shown(middle), limits, str(len(values)), middle <= bar if most else middle >= bar)

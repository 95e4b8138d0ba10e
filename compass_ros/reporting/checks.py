"""Is my result good? Each question that an engineer should ask of a calibration, answered from the result alone."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from compass_ros.reporting.numbers import probability, with_unit
from compass_ros.reporting.verdicts import meaning, title
from compass_ros.reporting.windows import word
from compass_ros.reporting.words import (
    VERDICT_LEVEL,
    Level,
    best_model,
    by_kind,
    fit_rmse,
    held_out_rmse,
    left_out_together,
    told,
)
from compass_ros.types import ParameterRow, Result

AT_FLOOR = 1.25
"""Held-out error over noise floor up to which the simulator counts as good as the noise allows."""
NEAR_FLOOR = 2.0
SMALLER = 0.4
"""Held-out error over the nominal one that a calibration should reach."""
OVERFIT = 1.3
"""Held-out error over fitted error from which the fit does not carry over fully."""
BOUND_SHARE = 0.01
"""A value nearer to a bound than this share of the range counts as stuck there."""
WORSE = 1.05
"""Held-out error with the effects over the one without from which they predict worse, not just the same."""
NAMES_SHOWN = 4

ORDER: tuple[Level, ...] = ("good", "note", "care", "bad")
SUMMARY: dict[Level, str] = {
    "good": "Yes. Every check passes.",
    "note": "Yes. Every check passes.",
    "care": "Usable with care. Read the marked lines first.",
    "bad": "No. Do not use these values before the marked lines are settled.",
}


@dataclass(frozen=True)
class Check:
    """One question and its answer."""

    level: Level
    title: str
    detail: str


def assess(result: Result) -> tuple[Check, ...]:
    """All checks, in the order in which they should be read."""
    return (
        *_stopped(result),
        *_floor(result),
        *_improvement(result),
        *_carries_over(result),
        *_identifiable(result),
        *_together(result),
        *_not_seen(result),
        *_at_bounds(result),
        *_verdict(result),
        *_effects_predict(result),
        *_left_out(result),
        *(Check("care", "Warning", warning) for warning in result.warnings),
        *_blind_spots(result),
    )


def overall(checks: Sequence[Check]) -> Level:
    """The worst level; notes count as good."""
    worst = max((ORDER.index(check.level) for check in checks), default=0)
    return "good" if ORDER[worst] == "note" else ORDER[worst]


def _stopped(result: Result) -> Iterator[Check]:
    if result.cancelled:
        yield Check("bad", "Stopped early", "The calibration was cancelled; these are the values it had by then.")
    if not result.held_out:
        yield Check(
            "bad", "Nothing held out", f"Every {word(result)} was fitted; nothing shows how well others are predicted."
        )


def _left_out(result: Result) -> Iterator[Check]:
    for count, bags, reason in left_out_together(result.left_out):
        yield Check("note", "Left out" if count == 1 else f"{count} left out", f"{bags}: {reason}")


def _floor(result: Result) -> Iterator[Check]:
    error, floor = held_out_rmse(result, best_model(result)), result.noise_floor_m
    if not math.isfinite(error):
        return
    if not (math.isfinite(floor) and floor > 0):
        text = f"Held-out error {with_unit(error, result.unit)}; how low it could be is unknown."
        yield Check("care", "Noise floor unknown", text)
        return
    ratio, said = error / floor, with_unit(floor, result.unit)
    numbers = f"Held-out error {with_unit(error, result.unit)}, {ratio:.1f} times the noise floor of {said}."
    if ratio <= AT_FLOOR:
        yield Check("good", "At the noise floor", f"{numbers} Better is not possible with these recordings.")
    elif ratio <= NEAR_FLOOR:
        yield Check("care", "Above the noise floor", f"{numbers} Some difference is still unexplained.")
    else:
        yield Check("bad", "Far above the noise floor", f"{numbers} Most of what is left is not noise.")


def _improvement(result: Result) -> Iterator[Check]:
    before, after = held_out_rmse(result, "nominal"), held_out_rmse(result, best_model(result))
    if not (math.isfinite(before) and math.isfinite(after) and before > 0):
        return
    ratio = after / before
    errors = [with_unit(error, result.unit) for error in (before, after)]
    numbers = f"{errors[0]} with the default parameters, {errors[1]} now; held-out {word(result)}s."
    if ratio <= SMALLER:
        yield Check("good", f"{1 / max(ratio, 1e-9):.0f} times closer than before", numbers)
    elif before <= AT_FLOOR * result.noise_floor_m:
        yield Check("good", "The default simulator was already right", numbers)
    else:
        yield Check("care" if ratio < 1 else "bad", "Little gained" if ratio < 1 else "Worse than before", numbers)


def _carries_over(result: Result) -> Iterator[Check]:
    model = best_model(result)
    fitted, held_out = fit_rmse(result, model), held_out_rmse(result, model)
    if not (math.isfinite(fitted) and math.isfinite(held_out) and fitted > 0):
        return
    errors = [with_unit(error, result.unit) for error in (fitted, held_out)]
    numbers = f"{errors[0]} on fitted {word(result)}s, {errors[1]} on held-out ones."
    if held_out <= OVERFIT * fitted:
        yield Check("good", f"Carries over to new {word(result)}s", numbers)
    else:
        yield Check("care", "Does not carry over fully", f"{numbers} Record more, or more varied, episodes.")


def _names(rows: Sequence[ParameterRow]) -> str:
    names = [row.name for row in rows[:NAMES_SHOWN]]
    more = len(rows) - len(names)
    return ", ".join(names) + (f" and {more} more" if more else "")


def _identifiable(result: Result) -> Iterator[Check]:
    active = [row for row in result.parameters if row.active]
    doubtful = [row for row in active if not row.identifiable]
    if doubtful:
        text = f"The recordings cannot pin down {_names(doubtful)}. Do not read these values as physics."
        yield Check("care", f"{len(doubtful)} of {len(active)} active parameters not identifiable", text)
    elif active:
        yield Check("good", "Parameters are identifiable", f"The recordings pin down all {len(active)} active ones.")


def _together(result: Result) -> Iterator[Check]:
    for group in result.together:
        text = f"{group.sentence}. Keep one of them at a value that was measured, and the others follow."
        yield Check("care", f"{len(group.parameters)} parameters told only together", text)


def _not_seen(result: Result) -> Iterator[Check]:
    grouped = {name for group in result.together for name in group.parameters}
    hidden = [r.name for r in result.parameters if not (r.active or r.identifiable or r.name in grouped)]
    if hidden:
        text = f"{by_kind(hidden)}: hardly anything in these recordings depends on it. Its value says nothing."
        yield Check("note", f"{len(hidden)} parameter{'s' * (len(hidden) > 1)} not seen", text)


def _at_bounds(result: Result) -> Iterator[Check]:
    stuck = []
    for row in result.parameters:
        low, high = row.bounds
        margin = BOUND_SHARE * (high - low)
        if told(row) and math.isfinite(margin) and not low + margin <= row.value <= high - margin:
            stuck.append(row)
    absent = [row for row in stuck if abs(row.value) < BOUND_SHARE * (row.bounds[1] - row.bounds[0])]
    if absent:
        text = f"{_names(absent)}. These recordings do not call for any."
        yield Check("note", f"{len(absent)} at zero", text)
    if stuck := [row for row in stuck if row not in absent]:
        text = f"{_names(stuck)}. The true value may lie outside, or the parameter stands in for something else."
        yield Check("care", f"{len(stuck)} at a bound", text)


def _verdict(result: Result) -> Iterator[Check]:
    verdict = result.mismatch.verdict
    level, detail = VERDICT_LEVEL[verdict], meaning(result.mismatch)
    if result.mismatch.effects:
        p = max(effect.evidence.false_alarm_p for effect in result.mismatch.effects)
        detail += f" Probability of a false alarm: {probability(p)}."
        level = "care" if level == "good" and p > 0.05 else level
    yield Check(level, title(result.mismatch), detail)


def _effects_predict(result: Result) -> Iterator[Check]:
    without, within = held_out_rmse(result, "calibrated"), held_out_rmse(result, "with_effects")
    if within > WORSE * without:
        errors = [with_unit(error, result.unit) for error in (without, within)]
        numbers = f"Held-out error {errors[0]} without it, {errors[1]} with it."
        detail = f"{numbers} The evidence weighs every frame by its noise, this error does not. Record more episodes."
        yield Check("care", "What was named does not predict better", detail)


def _blind_spots(result: Result) -> Iterator[Check]:
    names = result.mismatch.undetectable
    if names:
        text = f"These {word(result)}s could not have shown " + ", ".join(names[:NAMES_SHOWN])
        text += f" and {len(names) - NAMES_SHOWN} more." if len(names) > NAMES_SHOWN else "."
        yield Check("note", f"Blind to {len(names)} effect{'s' if len(names) > 1 else ''}", text)
